// What each chart of a run shows: the record of the run (live.js) as series.

import { Chart, axis, heat, limit, pins, series, time } from "./charts.js";
import { named } from "./colours.js";
import { count, exact, fixed, h, percent, rough, si } from "./figures.js";
import { TERMS } from "./live.js";
import { sizes } from "./snapshot.js";

const TALL = 250;
const MOST_COLUMNS = 240; // Of the heat map; more are less than a pixel wide on a phone.
const COUNTED = [["nodes", "compute"], ["facets", "exchange"], ["fragments", "fracture"]];
const ENERGIES = { terms: "Energy without the kinetic", internal: "Internal energy of the parts", kinetic: "Kinetic energy of the parts" };
const CURVE = 60; // Points of a fitted law.
const LEAST = 1; // Fragment, where the axis of their number begins.
const FLOOR = 1e-10; // Residuals below it are rounding.
const RESIDUAL = 1e-2; // Above it a run's energy does not close.

// { name: [chart, title, what stands beside the title] }; `onBalance` gets the place of a balance event in live.balances.
export function plots(live, onBalance) {
  const title = h("span", {}, ENERGIES.terms);
  const by = h("select", { "aria-label": "energy by", hidden: "", onchange: () => {
    title.textContent = ENERGIES[by.value];
    made.energy[0].draw();
  } }, Object.entries({ terms: "by term", internal: "internal, by part", kinetic: "kinetic, by part" }).map(([value, words]) => h("option", { value }, words)));
  const made = {
    sizes: [new Chart(TALL, "number of fragments of a size and more", () => ofSizes(made.snapshot, live.spread), { alone: true }), "Fragment sizes"],
    counts: [new Chart(TALL, "counts over time", () => ofCounts(live)), "Counts"],
    energy: [new Chart(TALL, "energy over time", () => ofEnergy(live, by)), title, by],
    residual: [new Chart(TALL, "energy residual over time", () => ofResidual(live)), "Energy residual"],
    imbalance: [new Chart(TALL, "load imbalance over time", () => ofImbalance(live),
      { onClick: ({ seriesName, dataIndex }) => seriesName === "balance" && onBalance(dataIndex), onEnter: (at) => live.balances.length && onBalance(nearest(live, at)) }), "Load imbalance, slowest over mean"],
    heat: [new Chart(TALL, "work of each rank over time", () => ofHeat(live), { alone: true }), "Work by rank and time"],
    dt: [new Chart(TALL, "time step over time", () => ofStep(live)), "Time step"],
    contact: [new Chart(TALL, "share of contact over time", () => ofContact(live)), "Share of contact in the CPU time"],
  };
  return made;
}

export const card = (title, note, ...content) => h("section.card.half", {}, h("div.card-head", {}, h("h2", {}, title), note), ...content);
export const parts = ({ ledger }) => Object.keys(ledger.at(-1)?.parts ?? {});

const end = ({ progress, ledger }) => (progress?.end_time ?? ledger.at(-1)?.t ?? 1);
const option = (live, y, list) => ({ xAxis: time(end(live)), yAxis: y, series: list });

function ofEnergy(live, by) {
  if (live.ledger.length < 2) return null;
  by.hidden = !parts(live).length;
  if (by.value !== "terms") return option(live, axis("J"), ofParts(live, by.value));
  const there = TERMS.filter(([name]) => name !== "kinetic" && live.ledger.some(({ energy }) => energy[name]));
  return option(live, axis("J"), there.map(([name, tone]) =>
    series({ name, colour: tone, unit: "J", stack: "energy", data: live.ledger.map(({ t, energy }) => [t, Math.max(0, energy[name])]) })));
}

// One area a part, in the colours that the parts have in the view of the body.
export const ofParts = (live, name) => parts(live).map((part, i) => series({ name: part, colour: named(i), unit: "J", stack: "energy",
  data: live.ledger.filter((row) => row.parts[part]).map((row) => [row.t, Math.max(0, row.parts[part][name] ?? 0)]) }));

function ofResidual(live) {
  if (live.ledger.length < 2) return null;
  const data = live.ledger.map(({ t, energy }) => [t, Math.max(FLOOR, energy.residual)]);
  return option(live, axis("", { type: "log", axisLabel: { formatter: (value) => exact(value, "", 1) } }),
    [{ ...series({ name: "residual", colour: "accent", data }), tooltip: { valueFormatter: (value) => rough(Number(value)) }, markLine: limit(RESIDUAL) }]);
}

function ofCounts(live) {
  const all = live.sizes;
  if (!all.length) return null;
  const now = { ...all.at(-1), t: Math.max(all.at(-1).t, live.loads.at(-1)?.t ?? 0) }; // Counts are told when they change.
  const there = COUNTED.filter(([name]) => all.some((point) => point[name] > 0));
  return option(live, axis("", { type: "log" }), there.map(([name, tone]) =>
    ({ ...series({ name, colour: tone, data: [...all, now].map((point) => [point.t, point[name] > 0 ? point[name] : null]) }), showSymbol: all.length < 3 })));
}

function ofImbalance(live) {
  const { loads, balances } = live;
  if (!loads.length) return null;
  const at = (t) => loads.findLast((point) => point.t <= t)?.imbalance ?? loads[0].imbalance;
  return option(live, axis("", { min: 1 }), [
    { ...series({ name: "imbalance", colour: "exchange", data: loads.map(({ t, imbalance }) => [t, imbalance]) }), tooltip: { valueFormatter: (value) => fixed(Number(value), 3) } },
    pins("balance", balances.map(({ t }) => [t, at(t)])),
  ]);
}

// The place of the cut that is nearest to a place in live.loads; the first of several.
function nearest({ loads, balances }, at) {
  const away = balances.map(({ t }) => Math.abs(t - loads[at].t));
  return Math.max(0, away.indexOf(Math.min(...away)));
}

function ofHeat(live) {
  const ranks = live.loads.at(-1)?.shares.length ?? 0;
  if (live.loads.length < 2) return null;
  const every = Math.ceil(live.loads.length / MOST_COLUMNS);
  const shown = live.loads.filter((_, i) => i % every === 0 && live.loads[i].shares.length === ranks);
  return heat(ranks, shown.map(({ t }) => t), shown.flatMap(({ shares }, at) => shares.map((share, rank) => [at, rank, Math.round(1000 * share) / 1000])));
}

function ofStep(live) {
  if (live.ledger.length < 2) return null;
  const data = live.ledger.filter(({ dt }) => dt > 0).map(({ t, dt, limiter }) => ({ value: [t, dt], limiter }));
  const told = { trigger: "axis", formatter: ([{ data: { value, limiter } }]) => `${si(value[0], "s")}\ndt ${si(value[1], "s")}\n${limiter ?? ""}`.trim() };
  return { ...option(live, axis("s", { scale: true }), [{ ...series({ name: "dt", colour: "elastic", unit: "s", data }), sampling: undefined }]), tooltip: { ...told } };
}

function ofContact(live) {
  if (!live.loads.length) return null;
  return option(live, axis("", { min: 0, max: 1, interval: 0.25, axisLabel: { formatter: (value) => percent(value, 0) } }),
    [{ ...series({ name: "contact", colour: "contact", data: live.loads.map(({ t, contact }) => [t, contact]) }), tooltip: { valueFormatter: (value) => percent(value) } }]);
}

// N(size) over the size, both logarithmic: of the snapshot that is shown, with the law that fits best, and of the newest
// report in its bins, which counts dust too.
function ofSizes(snapshot, spread) {
  const list = [...(snapshot ? ofSnapshot(snapshot) : []), ...(spread ? [ofSpread(spread)] : [])];
  if (!list.length) return null;
  return { xAxis: axis("m", { type: "log", splitLine: { show: false } }), yAxis: axis("", { type: "log", min: LEAST }), series: list,
    tooltip: { trigger: "item", formatter: ({ value }) => `${count(value[1])} of ${si(value[0], "m")} and more` } };
}

function ofSnapshot(snapshot) {
  const { points, best } = fitted(snapshot);
  if (points.length < 2) return [];
  const list = [{ ...series({ name: "as long and longer", colour: "compute", data: points }), type: "scatter", symbolSize: 4 }];
  if (best) {
    const [low, high] = [points[0][0], points.at(-1)[0]];
    const curve = Array.from({ length: CURVE }, (_, i) => low * (high / low) ** (i / (CURVE - 1))).map((size) => [size, points.length * best.longer(size)]);
    const told = best.law === "power" ? `exponent ${fixed(best.parameter)}` : si(best.parameter, "m");
    list.push({ ...series({ name: `${best.law} law, ${told}`, colour: "bad", data: curve.filter(([, number]) => number >= LEAST) }), lineStyle: { type: "dashed" } });
  }
  return list;
}

const known = new WeakMap(); // Fits by snapshot: the chart is drawn more often than it has new points.

function fitted(snapshot) {
  if (!known.has(snapshot)) known.set(snapshot, sizes(snapshot));
  return known.get(snapshot);
}

const ofSpread = ({ t, ...spread }) => ({ ...series({ name: `dust too, ${si(t, "s")}`, colour: "faint", data: longer(spread) }), step: "end", sampling: undefined });

// [size, number of fragments as long and longer] at the beginning of each bin, from bins of half a power of two.
export function longer({ smallest, sizes: counts }) {
  let left = counts.reduce((sum, count) => sum + count, 0);
  return counts.map((count, i) => {
    const point = [2 ** ((smallest + i) / 2), left];
    left -= count;
    return point;
  });
}
