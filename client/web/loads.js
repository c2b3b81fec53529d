// Charts of the load balance of the ranks over time: imbalance, work of each rank, CPU time by phase.

import { FONT, axis, colour, common, label, pins, series, shares, time } from "./axes.js";
import { end } from "./energies.js";
import { fixed, percent, si } from "./figures.js";
import { GROUPS } from "./live.js";

// Largest number of columns in the map of work; more columns would be thinner than a pixel on a phone.
const MOST_COLUMNS = 240;
const MOST_ROWS = 64; // Largest number of rows in the map of work; with more ranks, neighbouring ranks share a row.
// Descriptions of the groups of phases in live.js.
export const SPENT = { compute: "elements, nodes, facets", exchange: "messages between ranks", waiting: "waiting for other ranks", descheduled: "not scheduled" };

export function ofImbalance(live) {
  const { loads, balances } = live;
  if (!loads.length) return null;
  const at = (t) => loads.findLast((point) => point.t <= t)?.imbalance ?? loads[0].imbalance;
  return { xAxis: time(end(live)), yAxis: axis("", Math.max(...loads.map(({ imbalance }) => imbalance)), { min: 1 }), series: [
    series({ name: "imbalance", colour: "exchange", data: loads.map(({ t, imbalance }) => [t, imbalance]), text: (value) => fixed(Number(value), 3) }),
    pins("balance", balances.map(({ t }) => [t, at(t)])),
  ] };
}

// Returns the index of the balance event nearest to the report with the index `at` in live.loads; of several equal ones
// the first.
export function nearest({ loads, balances }, at) {
  const away = balances.map(({ t }) => Math.abs(t - loads[at].t));
  return Math.max(0, away.indexOf(Math.min(...away)));
}

export function ofSpent(live) {
  const { loads } = live;
  if (loads.length < 2) return null;
  const there = GROUPS.filter((name) => loads.some(({ by }) => by[name]));
  return { xAxis: time(end(live)), yAxis: shares(), series: there.map((name) =>
    series({ name: SPENT[name] ?? name, colour: name, stack: "spent", data: loads.map(({ t, by }) => [t, by[name] ?? 0]), text: (value) => percent(value) })) };
}

// Returns the cells { from, to, row, share } of the map of work. A report covers the time since the previous report.
// Many reports are joined to columns of equal duration, many ranks to rows.
export function cells(loads, ranks, last) {
  const rows = Math.min(ranks, MOST_ROWS);
  const known = loads.map((one, i) => ({ ...one, from: i ? loads[i - 1].t : 0 })).filter(({ shares: each }) => each.length === ranks);
  const columns = new Map();
  for (const { from, t, shares: each } of known) {
    const at = known.length > MOST_COLUMNS ? Math.min(MOST_COLUMNS - 1, Math.floor((MOST_COLUMNS * t) / last)) : t;
    const column = columns.get(at) ?? { from, to: t, number: 0, sums: new Array(rows).fill(0), of: new Array(rows).fill(0) };
    each.forEach((share, rank) => {
      const row = Math.floor((rank * rows) / ranks);
      column.sums[row] += share;
      column.of[row] += 1;
    });
    columns.set(at, { ...column, from: Math.min(from, column.from), to: Math.max(t, column.to) });
  }
  return [...columns.values()].flatMap(({ from, to, sums, of }) => sums.map((sum, row) => ({ from, to, row, share: sum / of[row] })));
}

// Returns the name of a row: its first and last rank.
export function rowName(row, ranks) {
  const rows = Math.min(ranks, MOST_ROWS);
  const [first, last] = [Math.ceil((row * ranks) / rows), Math.ceil(((row + 1) * ranks) / rows) - 1];
  return first === last ? `rank ${first}` : `ranks ${first} to ${last}`;
}

export function ofWork(live) {
  const ranks = live.loads.at(-1)?.shares.length ?? 0;
  if (live.loads.length < 2 || !ranks) return null;
  const data = cells(live.loads, ranks, end(live)).map(({ from, to, row, share }) => [from, to, row, Math.round(1000 * share) / 1000]);
  const names = Array.from({ length: Math.min(ranks, MOST_ROWS) }, (_, row) => rowName(row, ranks));
  return {
    grid: { left: 96, right: 14, top: 34, bottom: 26 }, legend: { show: false },
    tooltip: { ...common(true).tooltip, formatter: ({ value: [from, to, row, share] }) => `${names[row]}\n${si(from, "s")} to ${si(to, "s")}\n${percent(share, 0)} of the work of the busiest rank` },
    xAxis: time(end(live)),
    yAxis: { type: "category", data: names, inverse: true, axisLine: { show: false }, axisTick: { show: false }, axisLabel: label((name) => name) },
    visualMap: { min: 0, max: 1, dimension: 3, orient: "horizontal", top: 0, left: 92, itemWidth: 10, itemHeight: 120, text: ["as the busiest rank", "no work"], textStyle: { color: colour("soft"), fontSize: FONT },
      calculable: false, hoverLink: false, inRange: { color: [colour("track"), colour("compute")] } },
    series: [{ type: "custom", name: "work", aside: true, renderItem: drawCell, encode: { x: [0, 1], y: 2, tooltip: 3 }, data, progressive: 0, clip: true }],
  };
}

function drawCell(_, api) {
  const [left, middle] = api.coord([api.value(0), api.value(2)]);
  const [right] = api.coord([api.value(1), api.value(2)]);
  const height = api.size([0, 1])[1];
  return { type: "rect", shape: { x: left, y: middle - height / 2, width: Math.max(0.5, right - left + 0.4), height: height - (height > 4 ? 1 : 0) }, style: { fill: api.visual("color") } };
}

// Returns a table with one row for each report and one column for each rank: work relative to the busiest rank.
export const workTable = ({ loads }) => ({
  head: ["t [s]", ...(loads.at(-1)?.shares ?? []).map((_, rank) => `rank ${rank}`)], rows: loads.map(({ t, shares: each }) => [t, ...each]),
});
