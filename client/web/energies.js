// Charts of the energy of a run over time: the energy balance, whose terms add up to the energy input, and the energies
// of the parts.

import { axis, common, largest, limit, logarithmic, series, time } from "./axes.js";
import { named } from "./colours.js";
import { rough } from "./figures.js";
import { TERMS } from "./live.js";

export const VIEWS = { ledger: "all terms of the ledger", lost: "without the kinetic energy", internal: "internal energy by part", kinetic: "kinetic energy by part" };
// Fraction of the largest energy below which an energy term is not in the legend, because its area is too thin to be
// seen.
const SMALL = 0.01;
const FLOOR = 1e-10; // Residuals below this value are rounding errors.
const RESIDUAL = 1e-2; // Limit of the residual of the energy balance.

export const end = ({ plan, progress, columns, ledger }) => plan?.run?.end_time ?? progress?.end_time ?? columns.values.t.at(-1) ?? ledger.at(-1)?.t ?? 1;
export const parts = ({ ledger, columns }) => {
  const names = Object.keys(columns.values).filter((name) => name.startsWith("kinetic.")).map((name) => name.slice(8));
  return names.length ? names : Object.keys(ledger.at(-1)?.parts ?? {});
};

// Returns the points [[t, value]] of a column of the history; without a history, of the reports of the run.
export function course(live, name) {
  const { values } = live.columns;
  if (values[name]) return values.t.map((t, i) => [t, values[name][i]]);
  const [kind, part] = name.split(".");
  return live.ledger.map(({ t, energy, parts: each }) => [t, (part === undefined ? energy[name] : each?.[part]?.[kind]) ?? null]);
}

export const names = (live, view) => (view === "internal" || view === "kinetic" ? parts(live).map((part) => `${view}.${part}`) :
  [...TERMS.map(([name]) => name).filter((name) => view === "ledger" || name !== "kinetic"), "external", "initial"]);

export function ofEnergy(live, view) {
  const list = view === "internal" || view === "kinetic" ? ofParts(live, view) : ofTerms(live, view);
  if (!(list[0]?.data.length > 1)) return null;
  const most = largest(list);
  const named = list.filter(({ data, stack }) => !stack || data.some(([, value]) => Math.abs(value) >= SMALL * most)).map(({ name }) => name);
  return { xAxis: time(end(live)), yAxis: axis("J", most), series: list, legend: { ...common(false).legend, data: named } };
}

// Returns the energy terms as stacked areas, negative terms below zero. With the kinetic energy, their sum is the
// energy input, which is drawn as a line.
function ofTerms(live, view) {
  const all = TERMS.filter(([name]) => view === "ledger" || name !== "kinetic").map(([name, tone]) => ({ name: words(name), colour: tone, unit: "J", stack: "energy", data: course(live, name) }));
  const list = all.filter(({ data }) => data.some(([, value]) => value)).map(series);
  if (view !== "ledger") return list;
  const [initial, external] = [course(live, "initial"), course(live, "external")];
  const came = initial.map(([t, value], i) => [t, value + (external[i]?.[1] ?? 0)]);
  return [...list, series({ name: "input", colour: "ink", unit: "J", dash: [5, 4], width: 1.4, data: came, z: 4 })];
}

const words = (name) => ({ stepping: "time stepping", averaging: "pressure averaging", viscous: "viscosity" })[name] ?? name;

// Returns one area for each part, in the colours of the parts in the 3-D view.
export const ofParts = (live, view) => parts(live).map((part, i) =>
  series({ name: part, colour: named(i), unit: "J", stack: "energy", data: course(live, `${view}.${part}`).filter(([, value]) => value !== null) }));

export function ofResidual(live) {
  const data = course(live, "residual").map(([t, value]) => [t, value > FLOOR ? value : null]);
  if (!data.some(([, value]) => value)) return null;
  return { xAxis: time(end(live)), yAxis: logarithmic(""), series: [series({ name: "energy residual", colour: "accent", data, text: (value) => rough(Number(value)), markLine: limit(RESIDUAL) })] };
}
