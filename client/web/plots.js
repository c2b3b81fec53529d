// Series of the charts of a run, made from the record of the run (live.js).

import { axis, largest, logarithmic, series, time } from "./axes.js";
import { Chart } from "./charts.js";
import { VIEWS, end, names, ofEnergy, ofResidual } from "./energies.js";
import { count, exact, fixed, h, si } from "./figures.js";
import { everyLine, everyReport } from "./history.js";
import { FINAL, Live } from "./live.js";
import { alone } from "./numbers.js";
import { nearest, ofImbalance, ofSpent, ofWork, workTable } from "./loads.js";
import { Chooser, columnsOf, ofForces, ofProbes } from "./probes.js";
import { recall, remember } from "./storage.js";
import { tableOf } from "./tables.js";
import { sizes } from "./snapshot.js";

const TALL = 250;
const COUNTED = [["nodes", "compute"], ["facets", "exchange"], ["fragments", "fracture"]];
const CURVE = 60; // Number of points of the curve of a fitted law.
const LEAST = 1; // Smallest number of fragments on the axis.

// Returns { name: [chart, title, element beside the title] }. `onBalance` is called with the index of a balance event
// in live.balances. The charts are drawn after the promise `before`.
export function plots(live, onBalance, before) {
  const title = h("span", {}, "Energy");
  const by = h("select", { "aria-label": "energy by", onchange: () => {
    remember("energy.by", by.value);
    made.energy[0].draw();
  } }, Object.entries(VIEWS).map(([value, words]) => h("option", { value, selected: recall("energy.by", "ledger") === value ? "" : false }, words)));
  const view = () => by.value || "ledger";
  const chooser = new Chooser(live, () => {
    chooser.draw();
    made.probes[0].draw();
  });
  const lines = (of) => async () => (live.columns.lines ? everyLine(live.run, of()) : undefined);
  const reports = (of) => async () => tableOf(of(await everyReport(live, (run) => new Live(run))));
  const add = (name, label, titled, beside, option, more) => {
    const chart = new Chart(TALL, label, option, { ...more, before, missing: () => (FINAL.has(live.state) ? "This run has no numbers for this chart." : "Waiting for the first numbers."), name: () => `${live.plan?.name ?? live.run}_${name}` });
    return [chart, titled, [...beside, chart.tools]];
  };
  const made = {
    energy: add("energy", "energy over time", title, [by], () => ofEnergy(live, view()), { table: lines(() => names(live, view())) }),
    probes: add("probes", "probes over time", "Probes", [chooser.element], () => (chooser.draw(), ofProbes(live, chooser.chosen)), { table: lines(() => chooser.chosen) }),
    forces: add("forces", "contact forces over time", "Contact forces", [], () => ofForces(live), { table: lines(() => columnsOf(live)) }),
    sizes: add("sizes", "number of fragments of at least a given size", "Fragment sizes", [], () => ofSizes(made.snapshot, live.spread), { unit: "m", table: async () => tableOf({ ...ofSizes(made.snapshot, live.spread), xName: "size [m]" }) }),
    counts: add("counts", "nodes, broken facets and fragments over time", "Nodes and fragments", [], () => ofCounts(live), { table: reports(ofCounts) }),
    residual: add("residual", "energy residual over time", "Energy residual", [], () => ofResidual(live), { table: lines(() => ["residual"]) }),
    dt: add("dt", "time step over time", "Time step", [], () => ofStep(live), { table: reports(ofStep) }),
    imbalance: add("imbalance", "load imbalance over time", "Load imbalance", [], () => ofImbalance(live),
      { table: reports(ofImbalance), onClick: ({ seriesName, dataIndex }) => seriesName === "balance" && onBalance(dataIndex), onEnter: (at) => live.balances.length && onBalance(nearest(live, at)) }),
    heat: add("work", "work of each rank over time", "Work of each rank", [], () => ofWork(live), { alone: true, table: async () => workTable(await everyReport(live, (run) => new Live(run))) }),
    spent: add("cpu_time", "CPU time by phase over time", "CPU time by phase", [], () => ofSpent(live), { table: reports(ofSpent) }),
  };
  return made;
}

// Returns which charts have no data in this run, because it has no such probes or only one rank.
export const nothing = (live) => ({ imbalance: alone(live), heat: alone(live), probes: !live.plan?.probes?.length && !Object.keys(live.columns.values).some((name) => name.startsWith("momentum")), forces: !columnsOf(live).length });

function ofCounts(live) {
  const all = live.sizes;
  if (!all.length) return null;
  // Numbers of nodes and fragments are reported only when they change.
  const now = { ...all.at(-1), t: Math.max(all.at(-1).t, live.loads.at(-1)?.t ?? 0) };
  const there = COUNTED.filter(([name]) => all.some((point) => point[name] > 0));
  return { xAxis: time(end(live)), yAxis: logarithmic("", { axisLabel: { formatter: count } }), series: there.map(([name, tone]) =>
    ({ ...series({ name: name === "facets" ? "broken facets" : name, colour: tone, data: [...all, now].map((point) => [point.t, point[name] > 0 ? point[name] : null]), text: count }), showSymbol: all.length < 3 })) };
}

function ofStep(live) {
  if (live.ledger.length < 2) return null;
  const data = live.ledger.filter(({ dt }) => dt > 0).map(({ t, dt, limiter }) => ({ value: [t, dt], limiter }));
  const text = (value, point) => `${si(value, "s", 4)}${point?.limiter ? `, limited by ${point.limiter}` : ""}`;
  const list = [{ ...series({ name: "dt", colour: "elastic", unit: "s", data, text }), sampling: undefined }];
  return { xAxis: time(end(live)), yAxis: axis("s", largest(list), { scale: true }), series: list };
}

// Returns N(size) over the size, both logarithmic: for the shown snapshot with the best fitting law, and for the bins
// of the newest report, which include dust.
function ofSizes(snapshot, spread) {
  const list = [...(snapshot ? ofSnapshot(snapshot) : []), ...(spread ? [ofSpread(spread)] : [])];
  if (!list.length) return null;
  return { xAxis: logarithmic("m", { splitLine: { show: false } }), yAxis: logarithmic("", { min: LEAST, axisLabel: { formatter: count } }), series: list };
}

function ofSnapshot(snapshot) {
  const { points, best } = fitted(snapshot);
  if (points.length < 2) return [];
  const list = [{ ...series({ name: "fragments of this size and larger", colour: "compute", data: points, text: count }), type: "scatter", symbolSize: 4 }];
  if (best) {
    const [low, high] = [points[0][0], points.at(-1)[0]];
    const curve = Array.from({ length: CURVE }, (_, i) => low * (high / low) ** (i / (CURVE - 1))).map((size) => [size, points.length * best.longer(size)]);
    const parameter = best.law === "power" ? `exponent ${fixed(best.parameter)}` : si(best.parameter, "m");
    list.push({ ...series({ name: `${best.law} law, ${parameter}`, colour: "bad", data: curve.filter(([, number]) => number >= LEAST), text: (value) => fixed(value, 1) }), lineStyle: { type: "dashed" } });
  }
  return list;
}

const known = new WeakMap(); // Fitted laws by snapshot, because the chart is drawn more often than its points change.

export function fitted(snapshot) {
  if (!known.has(snapshot)) known.set(snapshot, sizes(snapshot));
  return known.get(snapshot);
}

const ofSpread = ({ t, ...spread }) => ({ ...series({ name: `with dust, at ${exact(t, "s", 3)}`, colour: "faint", data: longer(spread), text: count }), step: "end", sampling: undefined });

// Returns [size, number of fragments of at least this size] at the start of each bin of half a power of two.
export function longer({ smallest, sizes: counts }) {
  let left = counts.reduce((sum, count_) => sum + count_, 0);
  return counts.map((count_, i) => {
    const point = [2 ** ((smallest + i) / 2), left];
    left -= count_;
    return point;
  });
}
