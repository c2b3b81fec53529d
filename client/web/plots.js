// What each chart of a run shows: the record of the run (live.js) as series.

import { Chart, axis, heat, limit, pins, series, time } from "./charts.js";
import { h, percent, si } from "./figures.js";
import { TERMS } from "./live.js";
import { sizes } from "./snapshot.js";

const TALL = 250;
const MOST_COLUMNS = 240; // Of the heat map; more are less than a pixel wide on a phone.
const COUNTED = [["nodes", "compute"], ["facets", "exchange"], ["fragments", "fracture"]];
const RESIDUAL = 1e-2; // Above it a run's energy does not close.

// { name: { title, chart, note } }; `onBalance` gets the place of a balance event in live.balances.
export function plots(live, onBalance) {
  const made = {
    sizes: [new Chart(TALL, "number of fragments of a mass and more", () => ofSizes(made.snapshot), { alone: true }), "Fragment sizes"],
    counts: [new Chart(TALL, "counts over time", () => ofCounts(live)), "Counts"],
    energy: [new Chart(TALL, "energy over time, without the kinetic", () => ofEnergy(live)), "Energy without the kinetic"],
    residual: [new Chart(TALL, "energy residual over time", () => ofResidual(live)), "Energy residual"],
    imbalance: [new Chart(TALL, "load imbalance over time", () => ofImbalance(live),
      { onClick: ({ seriesName, dataIndex }) => seriesName === "balance" && onBalance(dataIndex) }), "Load imbalance, slowest over mean"],
    heat: [new Chart(TALL, "work of each rank over time", () => ofHeat(live), { alone: true }), "Work by rank and time"],
    dt: [new Chart(TALL, "time step over time", () => ofStep(live)), "Time step"],
    contact: [new Chart(TALL, "share of contact over time", () => ofContact(live)), "Share of contact in the CPU time"],
  };
  return made;
}

export const card = (title, note, ...content) => h("section.card.half", {}, h("div.card-head", {}, h("h2", {}, title), note), ...content);

const end = ({ progress, ledger }) => (progress?.end_time ?? ledger.at(-1)?.t ?? 1);
const option = (live, y, list) => ({ xAxis: time(end(live)), yAxis: y, series: list });

function ofEnergy(live) {
  if (live.ledger.length < 2) return null;
  const there = TERMS.filter(([name]) => name !== "kinetic" && live.ledger.some(({ energy }) => energy[name]));
  return option(live, axis("J"), there.map(([name, tone]) =>
    series({ name, colour: tone, unit: "J", stack: "energy", data: live.ledger.map(({ t, energy }) => [t, Math.max(0, energy[name])]) })));
}

function ofResidual(live) {
  if (live.ledger.length < 2) return null;
  const data = live.ledger.map(({ t, energy }) => [t, Math.max(1e-18, energy.residual)]);
  return option(live, axis("", { type: "log", axisLabel: { formatter: (value) => value.toExponential(0) } }),
    [{ ...series({ name: "residual", colour: "accent", data }), tooltip: { valueFormatter: (value) => Number(value).toExponential(1) }, markLine: limit(RESIDUAL) }]);
}

function ofCounts(live) {
  const all = live.sizes;
  if (!all.length) return null;
  const there = COUNTED.filter(([name]) => all.some((point) => point[name] > 0));
  return option(live, axis("", { type: "log" }), there.map(([name, tone]) =>
    ({ ...series({ name, colour: tone, data: all.map((point) => [point.t, point[name] > 0 ? point[name] : null]) }), showSymbol: all.length < 3 })));
}

function ofImbalance(live) {
  const { loads, balances } = live;
  if (!loads.length) return null;
  const at = (t) => loads.findLast((point) => point.t <= t)?.imbalance ?? loads[0].imbalance;
  return option(live, axis("", { min: 1 }), [
    { ...series({ name: "imbalance", colour: "exchange", data: loads.map(({ t, imbalance }) => [t, imbalance]) }), tooltip: { valueFormatter: (value) => Number(value).toFixed(3) } },
    pins("balance", balances.map(({ t }) => [t, at(t)])),
  ]);
}

function ofHeat(live) {
  const ranks = live.loads.at(-1)?.shares.length ?? 0;
  if (live.loads.length < 2) return null;
  const every = Math.ceil(live.loads.length / MOST_COLUMNS);
  const shown = live.loads.filter((_, i) => i % every === 0 && live.loads[i].shares.length === ranks);
  return heat(ranks, shown.map(({ t }) => t), shown.flatMap(({ shares }, at) => shares.map((share, rank) => [at, rank, Number(share.toFixed(3))])));
}

function ofStep(live) {
  if (live.ledger.length < 2) return null;
  const data = live.ledger.filter(({ dt }) => dt > 0).map(({ t, dt, limiter }) => ({ value: [t, dt], limiter }));
  const told = { trigger: "axis", formatter: ([{ data: { value, limiter } }]) => `${si(value[0], "s")}\ndt ${si(value[1], "s")}\n${limiter ?? ""}`.trim() };
  return { ...option(live, axis("s", { scale: true }), [{ ...series({ name: "dt", colour: "elastic", unit: "s", data }), sampling: undefined }]), tooltip: { ...told } };
}

function ofContact(live) {
  if (!live.loads.length) return null;
  return option(live, axis("", { min: 0, max: 1, axisLabel: { formatter: (value) => `${Math.round(100 * value)} %` } }),
    [{ ...series({ name: "contact", colour: "contact", data: live.loads.map(({ t, contact }) => [t, contact]) }), tooltip: { valueFormatter: (value) => percent(value) } }]);
}

// N(m) over m, both logarithmic, with the power law through it.
function ofSizes(snapshot) {
  if (!snapshot) return null;
  const { points, fit } = sizes(snapshot);
  if (points.length < 2) return null;
  const list = [{ ...series({ name: "fragments of this mass and more", colour: "compute", data: points }), type: "scatter", symbolSize: 4 }];
  if (fit) {
    const last = points.at(-1)[0];
    const law = [fit.low, last].map((mass) => [mass, Math.max(1e-3, fit.number * (mass / fit.low) ** -fit.exponent)]);
    list.push({ ...series({ name: `power law, exponent ${fit.exponent.toFixed(2)}`, colour: "bad", data: law }), lineStyle: { type: "dashed" } });
  }
  const grams = { type: "log", axisLabel: { formatter: (kilograms) => si(1000 * kilograms, "g", 1) } };
  return { xAxis: axis("", { ...grams, splitLine: { show: false } }), yAxis: axis("", { type: "log", min: 0.8 }), series: list,
    tooltip: { trigger: "item", formatter: ({ value }) => `${value[1]} of ${si(1000 * value[0], "g")} and more` } };
}
