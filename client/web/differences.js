// Differences between runs: names of the runs, keys of the cases that differ, results.

import { count, duration, exact, fixed, number, rough, scaleOf, words } from "./figures.js";

const NEVER = /^(name|title|description|reference\b.*)$/; // Keys that do not affect the answer of a run.
const FEW = 3; // Largest number of keys in the name of a run.
// Names of tables that are left out of the words for a key.
const PLACES = new Set(["parts", "run", "boundaries", "materials", "numerics"]);
const SHORT = 8; // Smallest number of characters of a short id.

const AXES = ["x", "y", "z"];

// Returns a case with all defaults as a flat object by key: { "run.ranks": 2, "parts[0].velocity[2]": 210, … }.
export function flat(value, key = "") {
  if (value === null || typeof value !== "object") return { [key]: value };
  const under = (name) => (Array.isArray(value) ? `${key}[${name}]` : key ? `${key}.${name}` : name);
  return Object.assign({}, ...Object.keys(value).map((name) => flat(value[name], under(name))));
}

// Returns [[key, value of the first case, of the second, …], …] for the keys that differ between cases.
export function differences(plans) {
  const all = plans.map((plan) => flat(plan ?? {}));
  const keys = [...new Set(all.flatMap(Object.keys))];
  return keys.filter((key) => !NEVER.test(key) && all.some((one) => (one[key] ?? null) !== (all[0][key] ?? null))).map((key) => [key, ...all.map((one) => one[key])]);
}

// Returns words for a key, such as "steel velocity z" for "parts[0].velocity[2]".
export function about(key, plan) {
  let at = plan;
  const parts = key.split(/[.[\]]+/).filter(Boolean).map((word) => {
    const list = Array.isArray(at) ? at : null;
    at = at?.[word];
    return list ? (list.length === AXES.length && typeof list[0] === "number" ? AXES[word] : list[word]?.name ?? word) : word;
  });
  return parts.filter((word) => !PLACES.has(word)).map(words).join(" ");
}

export function shown(value) {
  if (value === undefined || value === null) return "–";
  return typeof value === "number" ? number(value) : String(value);
}

// Returns the shortest unique prefixes of ids.
export function shortened(ids) {
  let length = SHORT;
  const longest = Math.max(0, ...ids.map((id) => id.length));
  while (length < longest && new Set(ids.map((id) => id.slice(0, length))).size < new Set(ids).size) length += 1;
  return ids.map((id) => id.slice(0, length));
}

// Returns names of runs: the name of the case; if names are equal, the few keys that differ, else the ids.
export function called(runs, differing, units = {}) {
  const names = runs.map(({ info }) => info.name || info.id);
  const ids = shortened(runs.map(({ info }) => info.id));
  const by = differing.length && differing.length <= FEW ? runs.map((_, i) => differing.map((change) => keyed(change, i, runs, units)).join(", ")) : ids;
  const labels = names.map((name, i) => (names.filter((other) => other === name).length < 2 ? name : names.every((other) => other === name) ? by[i] : `${name}, ${by[i]}`));
  return labels.map((name, i) => (labels.filter((other) => other === name).length < 2 ? name : `${name} (${ids[i]})`));
}

const keyed = ([key, ...values], i, runs, units) => `${about(key, runs[0].plan)} ${typeof values[i] === "number" ? exact(values[i], units[key] ?? "") : shown(values[i])}`;

// Returns a column for each of the first keys that differ: words, key, unit, values.
export const keyColumns = (differing, plan, units) => differing.map(([key, ...values]) => {
  const numbers = values.filter(Number.isFinite);
  const scale = scaleOf(Math.max(0, ...numbers.map(Math.abs)), units[key] ?? "");
  const text = (value) => (typeof value === "number" ? exact(Number(scale.text(value)), "", 6) : shown(value));
  return { title: about(key, plan), key, si: units[key] ?? "", unit: numbers.length ? scale.unit : "", values, text };
});

// Words for the quantities that every run has.
const QUANTITIES = {
  kinetic: "kinetic energy", elastic: "elastic energy", plastic: "plastic work", viscous: "work of bulk viscosity", contact: "energy lost in contact", friction: "work of friction",
  eroded: "energy of eroded tets", fracture: "energy of fracture", cohesive: "energy in cohesive facets", external: "work from outside", residual: "energy residual", dt: "time step",
  stepping: "error of unequal time steps", averaging: "energy of averaged pressures", fragments: "number of fragments", nodes: "number of nodes", imbalance: "load imbalance, slowest rank over mean",
};
export const inWords = (name) => QUANTITIES[name] ?? words(name.replace(/^(kinetic|internal)\.(.*)$/, "$1 energy of $2"));

// Results ----------------------------------------------------------------------------------------------------------------

// Returns columns [{ title, unit, values, text }] of comparable results, with one value for each run; null if a run has
// no value. `which`: whether the last, least or largest value of a probe is compared.
export function results(runs, which) {
  const probes = common(runs.map(({ plan }) => (plan?.probes ?? []).map(({ name }) => name)));
  const references = [...new Set(runs.flatMap(({ info }) => (info.outcome?.reference ?? []).map(({ name }) => name)))];
  const of = (title, unit, value, text = null) => column(title, unit, runs.map((run) => value(run) ?? null), text);
  const end = (name) => ({ info }) => info.outcome?.[name];
  return [
    ...probes.map((name) => of(name, unitOf(runs, name), ({ columns }) => columns.extremes?.[name]?.[which])),
    ...references.map((name) => of(`${name} (reference)`, runs.map(({ info }) => check(info, name)?.unit).find(Boolean) ?? "", ({ info }) => check(info, name)?.value)),
    of("references met", "", ({ info }) => (info.outcome?.reference?.length ? info.outcome.reference.filter(({ pass }) => pass).length / info.outcome.reference.length : null), (value) => fixed(100 * value, 0).concat(" %")),
    of("kinetic energy", "J", ({ columns }) => columns.extremes?.kinetic?.last),
    of("fragments", "", ({ info }) => info.outcome?.fragments, count), of("first broken facet", "s", end("first_break")), of("eroded tets", "", end("eroded"), count),
    of("worst energy residual", "", ({ info }) => info.outcome?.worst_residual, rough),
    of("simulated time", "s", ({ columns }) => columns.extremes?.t?.last), of("steps", "", end("steps"), count), of("elements", "", end("elements"), count),
    of("wall time", "s", end("elapsed"), duration), of("CPU time", "s", end("cpu"), duration),
  ].filter(({ values }) => values.some((value) => value !== null));
}

const check = (info, name) => (info.outcome?.reference ?? []).find((one) => one.name === name);
const unitOf = (runs, name) => runs.map(({ columns }) => columns.units[name]).find((unit) => unit !== undefined) ?? "";
export const common = (lists) => (lists.length ? lists[0].filter((name) => lists.every((list) => list.includes(name))) : []);

// Returns a column whose numbers have one unit, which is written in the header.
function column(title, unit, values, text) {
  const scale = scaleOf(Math.max(0, ...values.filter(Number.isFinite).map(Math.abs)), unit);
  return { title: words(title), si: unit, unit: text ? "" : scale.unit, values, text: (value) => (value === null ? "–" : text ? text(value) : exact(Number(scale.text(value)), "", 5)) };
}

