// What is known of a run: the history first, then its messages; one record out, nothing is drawn here.

export const FINAL = new Set(["succeeded", "failed", "cancelled", "timed_out", "lost"]);
export const GROUPS = ["compute", "contact", "exchange", "waiting", "output", "descheduled"];
export const TERMS = [["kinetic", "kinetic"], ["elastic", "elastic"], ["plastic", "plastic"], ["viscous", "viscous"], ["contact", "contact-work"], ["friction", "friction"], ["eroded", "eroded"], ["fracture", "fracture"], ["cohesive", "cohesive"], ["stepping", "stepping"], ["averaging", "averaging"]];

const MOST_POINTS = 2000;
const MOST_LINES = 1500;
const OWN = new Set(["contact", "exchange", "output"]); // Phases with a group of their own; the others are computing.

export class Live {
  constructor(run) {
    Object.assign(this, { run, seq: 0, state: "", cause: null, message: "", began: null, wall: 0, heard: 0 });
    Object.assign(this, { started: null, progress: null, load: null, counts: null, finished: null, loaded: 0 });
    this.plan = null; // The case with every default, null before it is there
    this.columns = { units: {}, values: { t: [] }, lines: 0 }; // Of history.csv: by name, as many values as t has
    this.ledger = []; // { t, dt, limiter, energy, parts: { name: { kinetic, internal } } }
    this.loads = []; // { t, imbalance, by: { group: share of the CPU time }, shares: [of the busiest, a rank] }
    this.sizes = []; // { t, nodes, facets, fragments }
    this.spread = null; // { t, smallest, sizes }: how many fragments have which size now
    this.found = -1; // Step of the newest state whose fragments are known
    this.balances = []; // the messages
    this.snapshots = []; // { n, t, fragments, … }
    this.log = []; // messages for people: of the log, of states, of checkpoints
    this.leftOut = 0; // Messages in the middle of a long log that the server has left out
    this.warnings = new Map(); // Level by text of every warning and error
  }

  take(message) {
    if (message.seq <= this.seq) return false;
    this.seq = message.seq;
    this.wall = message.wall;
    this.heard = Date.now() / 1000;
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

  // The newest line of the history, which a report has; what it does not have comes with the next answer of the server.
  follow({ sampled, energy, parts = {}, probes = {} }) {
    const { values } = this.columns;
    if (!(sampled > (values.t.at(-1) ?? Infinity))) return;
    const told = { t: sampled, ...energy, ...probes, ...Object.fromEntries(Object.entries(parts).flatMap(([part, one]) => Object.entries(one).map(([name, value]) => [`${name}.${part}`, value]))) };
    for (const [name, column] of Object.entries(values)) column.push(told[name] ?? null);
    if (values.t.length > 2 * MOST_POINTS) for (const [name, column] of Object.entries(values)) values[name] = column.filter((_, i) => i % 2 === 0);
  }

  on_load(message) {
    const interval = this.loaded ? message.wall - this.loaded : 0;
    const groups = grouped(message, interval);
    const others = ((message.threads ?? 1) - 1) * interval; // s of the threads of a rank besides its first
    this.loaded = message.wall;
    this.load = { ...message, groups, totals: totals(groups), helped: others > 0 ? message.helped.map((seconds) => seconds / others) : [] };
    keep(this.loads, { t: message.t, imbalance: message.imbalance, ...compared(groups) });
  }

  // Its fragments may be those of a step not long before, and a snapshot may have told of later ones.
  on_counts(message) {
    const { t, step, nodes, facets, counted = -1 } = message;
    const fragments = this.spreads(counted < 0 ? step : counted, message) ? message.fragments : this.counts?.fragments ?? message.fragments;
    this.counts = { ...message, fragments };
    keep(this.sizes, { t, nodes, facets, fragments });
  }

  // Whether nothing is known of a later step than that of the fragments of a message; their sizes are taken in.
  spreads(step, { t, smallest, sizes }) {
    if (step < this.found) return false;
    this.found = step;
    if (sizes?.length) this.spread = { t, smallest, sizes };
    return true;
  }

  on_balance(message) { this.balances.push(message); }

  // It counts the fragments too.
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

  // A warning that is said again is there once.
  warn(level, text) {
    if ((level === "warning" || level === "error") && !this.warnings.has(text)) this.warnings.set(text, level);
  }

  on_finished(message) { this.finished = message; }

  get fraction() {
    if (this.state === "succeeded") return 1;
    return this.progress ? Math.min(1, Math.max(0, this.progress.t / this.progress.end_time)) : 0;
  }

  // Wall time since the first step of the run's first start, s.
  get elapsed() {
    if (this.began === null) return undefined;
    return (FINAL.has(this.state) ? this.wall : Date.now() / 1000) - this.began;
  }

  // How old the newest message is, s, by this machine's clock.
  get age() { return this.heard ? Date.now() / 1000 - this.heard : undefined; }
}

// [noun, number] of the pieces of a run. The solver counts fragments where something can fracture; elsewhere only the
// snapshots count the pieces that erosion leaves.
export function pieces({ plan, counts, snapshots }) {
  return breaks(plan) ? ["fragment", counts?.fragments] : ["piece", snapshots.at(-1)?.fragments ?? counts?.fragments];
}

// Whether something of a case, or a bond of it, can break; true where the case is not known.
export const breaks = (plan) => !plan?.parts || plan.bond?.length > 0 || plan.parts.some(({ fracture }) => fracture);

// A series that grows too long loses every second point of its older half.
function keep(series, point) {
  series.push(point);
  if (series.length <= MOST_POINTS) return;
  const half = series.length >> 1;
  series.splice(0, half, ...series.slice(0, half).filter((_, i) => i % 2 === 0));
}

// CPU seconds of each rank by GROUPS. Waiting for other ranks costs CPU time and is measured; what is left of the wall
// time is neither: the machine has not run the rank, or the rank slept.
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

// The work of each rank over that of the busiest one, and what share of the CPU time of all ranks each group has.
export function compared(groups) {
  const work = totals(Object.fromEntries(["compute", "contact", "output"].filter((name) => groups[name]).map((name) => [name, groups[name]])));
  const most = Math.max(...work, 1e-300);
  const told = Object.entries(groups).filter(([name]) => name !== "descheduled").map(([name, seconds]) => [name, sum(seconds)]);
  const all = sum(told.map(([, seconds]) => seconds));
  return { shares: work.map((value) => value / most), by: Object.fromEntries(told.map(([name, seconds]) => [name, all > 0 ? seconds / all : 0])) };
}
