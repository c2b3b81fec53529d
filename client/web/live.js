// Record of a run: first its history, then its messages; the module draws nothing.

export const FINAL = new Set(["succeeded", "failed", "cancelled", "timed_out", "lost"]);
export const GROUPS = ["compute", "contact", "exchange", "waiting", "output", "descheduled"];
export const TERMS = [["kinetic", "kinetic"], ["elastic", "elastic"], ["plastic", "plastic"], ["viscous", "viscous"], ["contact", "contact-work"], ["friction", "friction"], ["eroded", "eroded"], ["fracture", "fracture"], ["cohesive", "cohesive"], ["stepping", "stepping"], ["averaging", "averaging"]];

const MOST_POINTS = 2000;
const MOST_LINES = 1500;
// Phases that have a group of their own; all other phases count as computing.
const OWN = new Set(["contact", "exchange", "output"]);

export class Live {
  constructor(run) {
    Object.assign(this, { run, seq: 0, state: "", cause: null, message: "", began: null, wall: 0, received: 0 });
    Object.assign(this, { started: null, progress: null, load: null, counts: null, finished: null, loaded: 0 });
    this.plan = null; // Case with all defaults; null while it is missing.
    this.columns = { units: {}, values: { t: [] }, lines: 0 }; // Columns of history.csv by name, each as long as t.
    this.ledger = []; // { t, dt, limiter, energy, parts: { name: { kinetic, internal } } }
    // Entries { t, imbalance, by: { group: fraction of the CPU time }, shares: [work of each rank / busiest rank] }.
    this.loads = [];
    this.sizes = []; // { t, nodes, facets, fragments }
    this.spread = null; // { t, smallest, sizes }: newest size distribution of the fragments.
    this.found = -1; // Step of the newest state with known fragments
    this.balances = []; // Messages about changes of the load balance.
    this.snapshots = []; // { n, t, fragments, … }
    this.log = []; // Messages for people: log, states, checkpoints.
    this.leftOut = 0; // Number of messages in the middle of a long log that the server left out.
    this.warnings = new Map(); // Level of every warning and error, by its text.
  }

  take(message) {
    if (message.seq <= this.seq) return false;
    this.seq = message.seq;
    this.wall = message.wall;
    this.received = Date.now() / 1000;
    this[`on_${message.type}`]?.(message);
    return true;
  }

  on_status(message) {
    Object.assign(this, { state: message.state, cause: message.cause, message: message.message ?? "" });
    if (message.state === "running") this.began ??= message.wall;
    this.note(message);
  }

  on_checkpoint(message) { this.note(message); }

  on_started(message) {
    this.started = message;
    this.loaded = message.wall;
  }

  on_progress(message) {
    this.progress = message;
    const { t, dt, limiter, energy, parts = {} } = message;
    keep(this.ledger, { t, dt, limiter, energy, parts });
    this.follow(message);
  }

  // Stores the newest row of the history, which has the form of a report; missing columns come with the next answer of
  // the server.
  follow({ sampled, energy, parts = {}, probes = {} }) {
    const { values } = this.columns;
    if (!(sampled > (values.t.at(-1) ?? Infinity))) return;
    const sample = { t: sampled, ...energy, ...probes, ...Object.fromEntries(Object.entries(parts).flatMap(([part, one]) => Object.entries(one).map(([name, value]) => [`${name}.${part}`, value]))) };
    for (const [name, column] of Object.entries(values)) column.push(sample[name] ?? null);
    if (values.t.length > 2 * MOST_POINTS) for (const [name, column] of Object.entries(values)) values[name] = column.filter((_, i) => i % 2 === 0);
  }

  on_load(message) {
    const interval = this.loaded ? message.wall - this.loaded : 0;
    const groups = grouped(message, interval);
    const others = ((message.threads ?? 1) - 1) * interval; // Time of the other threads of a rank, s.
    this.loaded = message.wall;
    this.load = { ...message, groups, totals: totals(groups), helped: others > 0 ? message.helped.map((seconds) => seconds / others) : [] };
    keep(this.loads, { t: message.t, imbalance: message.imbalance, ...compared(groups) });
  }

  // Handles a Counts message. The number of fragments in this message may belong to an earlier step than the number in
  // a snapshot.
  on_counts(message) {
    const { t, step, nodes, facets, counted = -1 } = message;
    const fragments = this.spreads(counted < 0 ? step : counted, message) ? message.fragments : this.counts?.fragments ?? message.fragments;
    this.counts = { ...message, fragments };
    keep(this.sizes, { t, nodes, facets, fragments });
  }

  // Returns true if the number of fragments in a message is the newest; then the sizes of the fragments are stored.
  spreads(step, { t, smallest, sizes }) {
    if (step < this.found) return false;
    this.found = step;
    if (sizes?.length) this.spread = { t, smallest, sizes };
    return true;
  }

  on_balance(message) { this.balances.push(message); }

  // Handles a Snapshot message, which also contains the number of fragments.
  on_snapshot(message) {
    if (this.spreads(message.step, message) && this.counts) this.counts = { ...this.counts, fragments: message.fragments };
    if (!this.snapshots.some(({ n }) => n === message.n)) this.snapshots.push(message);
  }

  on_log(message) {
    this.warn(message.level, message.text);
    this.note(message);
  }

  note(message) {
    this.log.push(message);
    if (this.log.length > MOST_LINES) this.log.shift();
  }

  // Stores a warning; a repeated warning is stored only once.
  warn(level, text) {
    if ((level === "warning" || level === "error") && !this.warnings.has(text)) this.warnings.set(text, level);
  }

  on_finished(message) { this.finished = message; }

  get fraction() {
    if (this.state === "succeeded") return 1;
    return this.progress ? Math.min(1, Math.max(0, this.progress.t / this.progress.end_time)) : 0;
  }

  // Wall time since the first step of the first start of the run, s.
  get elapsed() {
    if (this.began === null) return undefined;
    return (FINAL.has(this.state) ? this.wall : Date.now() / 1000) - this.began;
  }

  // Age of the newest message, s, by the clock of this machine.
  get age() { return this.received ? Date.now() / 1000 - this.received : undefined; }
}

// Removes every second point of the older half of a long series.
function keep(series, point) {
  series.push(point);
  if (series.length <= MOST_POINTS) return;
  const half = series.length >> 1;
  series.splice(0, half, ...series.slice(0, half).filter((_, i) => i % 2 === 0));
}

// Returns the CPU seconds of each rank by GROUPS. Waiting for other ranks uses CPU time and is measured. The rest of
// the wall time is not measured: the rank was not scheduled, or slept.
export function grouped({ phases = {}, waiting = [] }, interval) {
  const sums = {};
  for (const [name, seconds] of Object.entries(phases)) {
    const group = OWN.has(name) ? name : "compute";
    sums[group] = seconds.map((value, rank) => value + (sums[group]?.[rank] ?? 0));
  }
  if (sums.exchange && waiting.length) {
    sums.waiting = waiting.map((value, rank) => Math.min(value, sums.exchange[rank]));
    sums.exchange = sums.exchange.map((value, rank) => value - sums.waiting[rank]);
  }
  if (interval > 0) sums.descheduled = totals(sums).map((total) => Math.max(0, interval - total));
  return Object.fromEntries(GROUPS.filter((name) => sums[name]).map((name) => [name, sums[name]]));
}

export function totals(groups) {
  const lists = Object.values(groups);
  return (lists[0] ?? []).map((_, rank) => lists.reduce((sum, seconds) => sum + seconds[rank], 0));
}

const sum = (values = []) => values.reduce((total, value) => total + value, 0);

// Returns the work of each rank relative to the busiest rank, and the fraction of each group in the CPU time of all
// ranks.
export function compared(groups) {
  const work = totals(Object.fromEntries(["compute", "contact", "output"].filter((name) => groups[name]).map((name) => [name, groups[name]])));
  const most = Math.max(...work, 1e-300);
  const parts = Object.entries(groups).filter(([name]) => name !== "descheduled").map(([name, seconds]) => [name, sum(seconds)]);
  const all = sum(parts.map(([, seconds]) => seconds));
  return { shares: work.map((value) => value / most), by: Object.fromEntries(parts.map(([name, seconds]) => [name, all > 0 ? seconds / all : 0])) };
}
