// What is known of a run from its messages: messages in, one record out; nothing is drawn here.

export const FINAL = new Set(["succeeded", "failed", "cancelled", "timed_out", "lost"]);
export const PHASES = ["compute", "contact", "exchange", "output", "wait"];
export const TERMS = [["kinetic", "kinetic"], ["elastic", "elastic"], ["plastic", "plastic"], ["viscous", "viscous"], ["contact", "contact-work"], ["friction", "friction"], ["eroded", "eroded"], ["fracture", "fracture"], ["cohesive", "cohesive"]];

const MOST_POINTS = 1200;
const MOST_LINES = 500;

export class Live {
  constructor(run) {
    Object.assign(this, { run, seq: 0, state: "accepted", cause: null, message: "", began: null, wall: 0, frames: 0 });
    Object.assign(this, { started: null, progress: null, load: null, counts: null, finished: null, log: [] });
    this.ledger = []; // { t, wall, energy }
    this.loads = []; // { wall, imbalance, busy: [share a rank] }
  }

  take(message) {
    if (message.seq <= this.seq) return false;
    this.seq = message.seq;
    this.wall = message.wall;
    this[`on_${message.type}`]?.(message);
    return true;
  }

  on_status(message) {
    Object.assign(this, { state: message.state, cause: message.cause, message: message.message ?? "" });
    if (message.state === "running") this.began ??= message.wall;
  }

  on_started(message) {
    this.started = message;
    this.loaded = message.wall;
  }

  on_progress(message) {
    this.progress = message;
    keep(this.ledger, { t: message.t, energy: message.energy });
  }

  on_load(message) {
    const groups = grouped(message.phases, this.loaded ? message.wall - this.loaded : 0);
    const totals = rankTotals(groups);
    const lost = (rank) => (groups.exchange?.[rank] ?? 0) + (groups.wait?.[rank] ?? 0);
    const busy = totals.map((total, rank) => (total > 0 ? 1 - lost(rank) / total : 0));
    this.loaded = message.wall;
    this.load = { ...message, groups, totals, busy };
    keep(this.loads, { t: message.t, imbalance: message.imbalance, busy });
  }

  on_counts(message) { this.counts = message; }

  on_frame() { this.frames += 1; }

  on_log(message) {
    this.log.push(message);
    if (this.log.length > MOST_LINES) this.log.shift();
  }

  on_finished(message) { this.finished = message; }

  get fraction() {
    if (this.state === "succeeded") return 1;
    return this.progress ? Math.min(1, Math.max(0, this.progress.t / this.progress.end_time)) : 0;
  }

  get elapsed() {
    if (this.began === null) return undefined;
    return (FINAL.has(this.state) ? this.wall : Date.now() / 1000) - this.began;
  }
}

// A series that grows too long loses every second point of its older half.
function keep(series, point) {
  series.push(point);
  if (series.length <= MOST_POINTS) return;
  const half = series.length >> 1;
  series.splice(0, half, ...series.slice(0, half).filter((_, i) => i % 2 === 0));
}

// Phases of the worker summed into PHASES. Where it does not time its waits, what is left of the interval is the wait.
function grouped(phases, interval) {
  const sums = {};
  for (const [name, seconds] of Object.entries(phases ?? {})) {
    const group = PHASES.includes(name) ? name : "compute";
    sums[group] = seconds.map((value, rank) => value + (sums[group]?.[rank] ?? 0));
  }
  if (!sums.wait && interval > 0) sums.wait = rankTotals(sums).map((total) => Math.max(0, interval - total));
  return Object.fromEntries(PHASES.filter((name) => sums[name]).map((name) => [name, sums[name]]));
}

function rankTotals(groups) {
  const lists = Object.values(groups);
  return (lists[0] ?? []).map((_, rank) => lists.reduce((sum, seconds) => sum + seconds[rank], 0));
}
