// Chart of the probes of a run over time, with a panel for each unit, and their expected values.

import { axis, expected, largest, lineStyle, series, time } from "./axes.js";
import { end } from "./energies.js";
import { h } from "./figures.js";
import { recall, remember } from "./storage.js";

const MOST_AT_FIRST = 8;
const MOMENTA = /^(angular_)?momentum_[xyz]$/;
const PUSH = /^(contact|wall)_force_([xyz])$/;

const probes = ({ plan }) => plan?.probes ?? [];
const isThere = ({ columns }) => (name) => name in columns.values;

// Returns the names that can be selected: probes of the case in their order, then momenta.
export function choices(live) {
  const names = probes(live).map(({ name }) => name);
  return { probes: names.filter(isThere(live)), momenta: Object.keys(live.columns.values).filter((name) => MOMENTA.test(name) && !names.includes(name)) };
}

// List of check boxes below a button; the selection is stored by the name of the case.
export class Chooser {
  constructor(live, onChange) {
    Object.assign(this, { live, onChange });
    this.summary = h("summary", {}, "Choose");
    this.list = h("div.probe-list", { role: "group", "aria-label": "probes in the chart" });
    this.element = h("details.probe-chooser", { hidden: "", onkeydown: ({ key }) => { if (key === "Escape") this.shut(); } }, this.summary, this.list);
    this.element.addEventListener("focusout", ({ relatedTarget }) => { if (relatedTarget && !this.element.contains(relatedTarget)) this.element.open = false; });
  }

  get key() { return `probes.${this.live.plan?.name ?? ""}`; }

  get chosen() {
    const { probes: names, momenta } = choices(this.live);
    const kept = [recall(this.key, null)].find(Array.isArray)?.filter((name) => names.includes(name) || momenta.includes(name));
    const forces = columnsOf(this.live);
    const others = names.filter((name) => !forces.includes(name)); // Forces have a chart of their own.
    return kept ?? (others.length ? others : names).slice(0, MOST_AT_FIRST);
  }

  shut() {
    this.element.open = false;
    this.summary.focus();
  }

  draw() {
    const { probes: names, momenta } = choices(this.live);
    this.element.hidden = !names.length && !momenta.length;
    this.summary.textContent = `${this.chosen.length} of ${names.length + momenta.length}`;
    const state = [...names, "", ...momenta].join("/");
    if (this.drawn === state) return;
    this.drawn = state;
    const box = (name) => h("label", {}, h("input", { type: "checkbox", value: name, checked: this.chosen.includes(name) ? "" : false, onchange: () => this.take() }), " ", name);
    this.list.replaceChildren(...names.map(box), ...(momenta.length ? [h("b", {}, "of the whole"), ...momenta.map(box)] : []));
  }

  take() {
    remember(this.key, [...this.list.querySelectorAll("input:checked")].map(({ value }) => value));
    this.onChange();
  }
}

// Returns the expected values of a probe, each with its time interval.
function references({ plan }, name, last) {
  const own = (plan?.reference ?? []).filter(({ probe, quantity }) => probe === name && quantity.startsWith("probe_"));
  return own.map(({ quantity, value, tolerance, since, until }) => ({ value, tolerance, until: until ?? last, since: quantity === "probe_last" ? 0.97 * last : since ?? 0 }));
}

// Returns a chart with one panel for each unit and a common time axis.
export function ofProbes(live, chosen) {
  const { columns: { units, values } } = live;
  const there = chosen.filter(isThere(live));
  if (!there.length || values.t.length < 2) return null;
  const last = end(live);
  const list = there.map((name, i) => {
    const { colour, dash } = lineStyle(i);
    const [reference] = references(live, name, last);
    return { ...series({ name, unit: units[name], colour, dash, data: values.t.map((t, at) => [t, values[name][at]]) }), ...(reference ? expected(reference, colour) : {}) };
  });
  return panels(list, last);
}

// Arranges series in a panel for each unit. `last` is the end of the time axis.
export function panels(list, last) {
  const kinds = [...new Set(list.map(({ unit }) => unit))];
  const number = kinds.length;
  const of = kinds.map((unit) => list.filter((one) => one.unit === unit));
  const place = (i) => ({ top: `${10 + (84 * i) / number}%`, height: `${84 / number - (i < number - 1 ? 9 : 2)}%` });
  return {
    grid: kinds.map((_, i) => ({ left: 64, right: 14, ...(number > 1 ? place(i) : { top: 40, bottom: 26 }) })),
    xAxis: kinds.map((_, i) => time(last, { gridIndex: i, ...(i < number - 1 ? { axisLabel: { show: false } } : {}) })),
    yAxis: kinds.map((unit, i) => axis(unit, heights(of[i]), { gridIndex: i })),
    axisPointer: { link: [{ xAxisIndex: "all" }] },
    series: list.map((one) => ({ ...one, xAxisIndex: kinds.indexOf(one.unit), yAxisIndex: kinds.indexOf(one.unit) })),
  };
}

// Returns the largest magnitude of series and of their expected values.
const heights = (list) => Math.max(largest(list), ...list.flatMap(({ markArea }) => (markArea ? markArea.data.flat().map(({ coord }) => Math.abs(coord[1])) : [])));

// Contact forces ---------------------------------------------------------------------------------------------------------

// Returns the probes of forces, { "steel on glass": { part, x: column, y: column, z: column } }.
export function pushes(live) {
  const found = {};
  for (const { name, part, field, by, wall } of probes(live).filter((one) => PUSH.test(one.field) && isThere(live)(one.name))) {
    const [, kind, component] = PUSH.exec(field);
    const from = kind === "wall" ? `wall${wall ? ` ${wall}` : "s"}` : by ?? "all others";
    (found[`${from} on ${part || "all parts"}`] ??= {})[component] = name;
  }
  return found;
}

export const columnsOf = (live) => Object.values(pushes(live)).flatMap(Object.values);

// Returns the measured components of forces, and the magnitude if all three components exist. Thinned columns give no
// magnitude, because their components belong to different times.
export function ofForces(live) {
  const { columns: { values, lines } } = live;
  const list = Object.entries(pushes(live)).flatMap(([who, columns]) => {
    const each = Object.entries(columns).sort().map(([component, name]) => [`${who}, ${component}`, values[name]]);
    const whole = ["x", "y", "z"].map((component) => values[columns[component]]);
    if (whole.every(Boolean) && lines <= values.t.length) each.unshift([`${who}, magnitude`, values.t.map((_, i) => Math.hypot(...whole.map((column) => column[i])))]);
    return each;
  });
  if (!list.length || values.t.length < 2) return null;
  const drawn = list.map(([name, column], i) => {
    const { colour, dash } = lineStyle(i);
    return series({ name, unit: "N", colour, dash, data: values.t.map((t, at) => [t, column[at]]) });
  });
  return { xAxis: time(end(live)), yAxis: axis("N", largest(drawn)), series: drawn };
}
