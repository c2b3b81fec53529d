// Fills the record of a run from the server's history: one answer instead of every message since the start.

import { Problem, call } from "./api.js";
import { TERMS, compared, grouped, totals } from "./live.js";

const POINTS = 1000;

// `info` is the run as the server tells it, `plan` its case with every default, null before it is there.
export async function fill(live, info, plan, signal) {
  take(live, await call(`v1/runs/${encodeURIComponent(live.run)}/history?points=${POINTS}`, { signal }), info, plan);
}

// The case of a run with all defaults, null while it is not written yet.
export async function readPlan(run, signal) {
  try {
    return await call(`v1/runs/${encodeURIComponent(run)}/files/case.resolved.json`, { signal });
  } catch (error) {
    if (error instanceof Problem && error.status === 404) return null;
    throw error;
  }
}

export function take(live, history, info = {}, plan = null) {
  const { series = {}, parts = {}, sizes = {}, ranks = {}, balance = [], snapshots = [], log = [], warnings = [], last, state, elapsed } = history;
  const number = series.t?.length ?? 0;
  const rows = Array.from({ length: number }, (_, i) => Object.fromEntries(Object.entries(series).map(([name, values]) => [name, values[i]])));
  live.ledger = rows.map((row, i) => ({ t: row.t, dt: row.dt, limiter: row.limiter, energy: energy(row), parts: at(parts, i) })).filter(({ dt }) => Number.isFinite(dt));
  live.sizes = rows.filter((row) => Number.isFinite(row.nodes)).map(({ t, nodes, facets, fragments }) => ({ t, nodes, facets, fragments }));
  live.loads = loads(ranks, rows);
  if (sizes.sizes?.length) live.spread = sizes;
  live.balances = balance;
  live.snapshots = snapshots;
  Object.assign(live, { log, leftOut: history.log_left_out ?? 0, warnings: new Map(warnings.map(({ text, level }) => [text, level])) });
  Object.assign(live, { seq: last, state, heard: Date.now() / 1000 });
  Object.assign(live, { cause: info.cause ?? null, message: info.message ?? "" });
  if (elapsed > 0) Object.assign(live, { wall: Date.now() / 1000, began: Date.now() / 1000 - elapsed, loaded: Date.now() / 1000 });
  if (rows.length) latest(live, rows.at(-1), ranks, info.progress, plan);
}

// What the head and the bars show until the next message: the newest report.
function latest(live, row, ranks, progress, plan) {
  const ledger = live.ledger.at(-1);
  const end = plan?.run?.end_time ?? progress?.end_time ?? row.t;
  const told = { ...row, limiter: ledger?.limiter ?? "", dt: ledger?.dt ?? 0, energy: ledger?.energy };
  if (ledger) live.progress = progress ?? { ...told, end_time: end };
  if (Number.isFinite(row.nodes)) live.counts = row;
  const [phases, waiting] = phasesAt(ranks, (ranks.t?.length ?? 0) - 1);
  const groups = grouped({ phases, waiting }, 0);
  live.load = { imbalance: row.imbalance, groups, totals: totals(groups) };
}

// Of { part: { kinetic: […], internal: […] } } one moment.
const at = (parts, i) => Object.fromEntries(Object.entries(parts).map(([part, columns]) =>
  [part, Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, values[i]]))]));

const energy = (row) => Object.fromEntries([...TERMS.map(([name]) => name), "external", "initial", "residual"].map((name) => [name, row[name] ?? 0]));

const NUMBERS = new Set(["t", "steps", "waiting"]); // Of `ranks`; all else are phases.

function phasesAt(ranks, i) {
  const names = Object.keys(ranks).filter((name) => !NUMBERS.has(name) && ranks[name][i]?.length);
  return [Object.fromEntries(names.map((name) => [name, ranks[name][i]])), ranks.waiting?.[i] ?? []];
}

function loads(ranks, rows) {
  const known = rows.filter((row) => Number.isFinite(row.imbalance));
  let place = 0;
  return (ranks.t ?? []).map((t, i) => {
    while (place + 1 < known.length && known[place + 1].t <= t) place += 1;
    const [phases, waiting] = phasesAt(ranks, i);
    return { t, imbalance: known[place]?.imbalance ?? 1, ...compared(grouped({ phases, waiting }, 0)) };
  });
}
