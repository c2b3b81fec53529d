// Reads the history of a run from the server, so that one answer replaces all past messages.

import { Problem, call, refused, text } from "./api.js";
import { FINAL, TERMS, compared, grouped, totals } from "./live.js";
import { pick } from "./tables.js";

const POINTS = 1000;
const MOST = 4096; // Largest number of reports that the server sends.
const SOON = 2000; // Time in ms after which missing columns of the history are requested again.
// Time in ms after which the columns of an open run are requested again, because the stream has only some of the rows.
const LATER = 15000;

const path = (run) => `v1/runs/${encodeURIComponent(run)}`;
const pause = (ms, signal) => new Promise((resolve) => {
  const timer = setTimeout(resolve, ms);
  signal.addEventListener("abort", () => { clearTimeout(timer); resolve(); }, { once: true });
});

// Fills the record `live` of a run. `info`: the run from the server. The case with all defaults is null while it is
// missing.
export async function fill(live, info, signal) {
  const columns = readColumns(live.run, undefined, undefined, signal).catch(() => live.columns);
  const [history, plan] = await Promise.all([call(`${path(live.run)}/history?points=${POINTS}`, { signal }), readPlan(live.run, signal)]);
  take(live, history, info, plan);
  live.columns = await columns;
}

// Returns the named columns of history.csv, or all columns: { units, values, lines, extremes }.
export async function readColumns(run, names = ["*"], points = POINTS, signal = undefined) {
  const words = [...names.map((name) => `name=${encodeURIComponent(name)}`), `points=${points}`];
  let answer = await call(`${path(run)}/columns?${words.join("&")}`, { signal });
  while (answer.behind) answer = await call(`${path(run)}/columns?${words.join("&")}`, { signal });
  const units = Object.fromEntries(Object.entries(answer.columns).map(([name, { unit }]) => [name, unit]));
  return { units, values: { t: [], ...answer.values }, lines: answer.lines, extremes: answer.columns };
}

// Updates the columns of an open run until its end; `onNews` is called after a change.
export async function followColumns(live, signal, onNews) {
  for (let over = FINAL.has(live.state); !over && !signal.aborted;) {
    await untilLater(live, signal);
    over = FINAL.has(live.state);
    try {
      live.columns = await readColumns(live.run, undefined, undefined, signal);
      onNews();
    } catch (error) {
      if (refused(error)) return; // The page of the run reports the error.
      over = false;
      await pause(LATER, signal);
    }
  }
}

// Waits some seconds, or until the end of the run.
async function untilLater(live, signal) {
  const until = Date.now() + (live.columns.lines ? LATER : SOON);
  while (Date.now() < until && !FINAL.has(live.state) && !signal.aborted) await pause(SOON / 4, signal);
}

// Returns { head, rows } of columns of history.csv with every row of the file.
export const everyLine = async (run, names) => pick(await text(`${path(run)}/files/history.csv`), names);

// Returns a record of the same run with as many reports as the server has.
export async function everyReport(live, make) {
  const whole = make(live.run);
  take(whole, await call(`${path(live.run)}/history?points=${MOST}`), {}, live.plan);
  return whole;
}

// Returns the case of a run with all defaults; null until the case is written.
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
  live.plan = plan ?? live.plan;
  live.balances = balance;
  live.snapshots = snapshots;
  Object.assign(live, { log, leftOut: history.log_left_out ?? 0, warnings: new Map(warnings.map(({ text, level }) => [text, level])) });
  Object.assign(live, { seq: last, state, received: Date.now() / 1000 });
  Object.assign(live, { cause: info.cause ?? null, message: info.message ?? "" });
  if (elapsed > 0) Object.assign(live, { wall: Date.now() / 1000, began: Date.now() / 1000 - elapsed, loaded: Date.now() / 1000 });
  if (rows.length) latest(live, rows.at(-1), ranks, info.progress, plan);
}

// Returns the newest report, which the head and the bars show until the next message.
function latest(live, row, ranks, progress, plan) {
  const ledger = live.ledger.at(-1);
  const end = plan?.run?.end_time ?? progress?.end_time ?? row.t;
  const newest = { ...row, limiter: ledger?.limiter ?? "", dt: ledger?.dt ?? 0, energy: ledger?.energy };
  if (ledger) live.progress = progress ?? { ...newest, end_time: end };
  if (Number.isFinite(row.nodes)) live.counts = row;
  const [phases, waiting] = phasesAt(ranks, (ranks.t?.length ?? 0) - 1);
  const groups = grouped({ phases, waiting }, 0);
  live.load = { imbalance: row.imbalance, groups, totals: totals(groups) };
}

// Returns the values of { part: { kinetic: […], internal: […] } } at one time.
const at = (parts, i) => Object.fromEntries(Object.entries(parts).map(([part, columns]) =>
  [part, Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, values[i]]))]));

const energy = (row) => Object.fromEntries([...TERMS.map(([name]) => name), "external", "initial", "residual"].map((name) => [name, row[name] ?? 0]));

const NUMBERS = new Set(["t", "steps", "waiting"]); // Members of `ranks` that are not phases.

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
