// Fills the record of a run from the server's history: one answer instead of every message since the start.

import { Problem, call } from "./api.js";
import { TERMS, compared, grouped } from "./live.js";

const POINTS = 1000;

// True when the history was there; a server or a run without one is read from its first message.
export async function fill(live, signal) {
  const run = `v1/runs/${encodeURIComponent(live.run)}`;
  try {
    take(live, await call(`${run}/history?points=${POINTS}`, { signal }));
    return true;
  } catch (error) {
    if (error instanceof Problem && error.status === 404) return false;
    throw error;
  }
}

export function take(live, history) {
  const { series = {}, ranks = {}, balance = [], snapshots = [] } = history;
  const number = series.t?.length ?? 0;
  const rows = Array.from({ length: number }, (_, i) => Object.fromEntries(Object.entries(series).map(([name, values]) => [name, values[i]])));
  live.ledger = rows.filter((row) => Number.isFinite(row.dt)).map((row) => ({ t: row.t, dt: row.dt, limiter: row.limiter, energy: energy(row) }));
  live.sizes = rows.filter((row) => Number.isFinite(row.nodes)).map(({ t, nodes, facets, fragments }) => ({ t, nodes, facets, fragments }));
  live.loads = loads(ranks, rows);
  live.balances = balance;
  live.snapshots = snapshots;
  live.seq = history.last;
  live.state = history.state ?? live.state;
  for (const name of ["started", "progress", "counts", "load"]) if (history[name]) live[`on_${name}`](history[name]);
  for (const line of history.log ?? []) live.on_log(line);
  if (Number.isFinite(history.elapsed)) live.began = (history.wall ?? Date.now() / 1000) - history.elapsed;
  live.wall = history.wall ?? live.wall;
}

const energy = (row) => Object.fromEntries([...TERMS.map(([name]) => name), "external", "initial", "residual"].map((name) => [name, row[name] ?? row[`energy.${name}`] ?? 0]));

function loads(ranks, rows) {
  const { t = [], waiting = [], imbalance, ...phases } = ranks;
  const known = rows.filter((row) => Number.isFinite(row.imbalance));
  return t.map((time, i) => {
    const seconds = Object.fromEntries(Object.entries(phases).filter(([, values]) => Array.isArray(values?.[i])).map(([name, values]) => [name, values[i]]));
    const groups = grouped({ phases: seconds, waiting: waiting[i] ?? [] }, 0);
    return { t: time, imbalance: imbalance?.[i] ?? known.findLast((row) => row.t <= time)?.imbalance ?? 1, ...compared(groups) };
  });
}
