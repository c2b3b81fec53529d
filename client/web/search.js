// Page of an adaptive sweep: the result with its uncertainty, and a chart of points, bracket and curve.

import { axis, colour, common, crosses, series } from "./axes.js";
import { Chart } from "./charts.js";
import { counted, exact, h, moment, si, vector } from "./figures.js";

const TALL = 340;
// Time in s without a report and without an open run after which the command of the sweep counts as ended.
const SILENT = 120;

// Returns true if the sweep may continue. A run may take longer than SILENT, because the command reports when a run
// ends.
export const goesOn = ({ search, reported, states }, now = Date.now() / 1000) =>
  !search.over && (now - reported < SILENT || Object.keys(states).some((state) => OPEN.has(state)));
const OPEN = new Set(["accepted", "queued", "starting", "running", "stopping"]);

export class Answer {
  constructor() {
    this.chart = new Chart(TALL, "the result at each point, with bracket and curve", () => this.option(), {
      alone: true, name: () => `${this.info.name}-adaptive`, table: () => this.table(), onClick: ({ data }) => { if (data?.[2]) location.hash = `#/runs/${data[2]}`; },
    });
    this.found = h("p.threshold-found", { role: "status" });
    this.sought = h("p.threshold-sought");
    this.facts = h("dl.facts");
    this.notes = h("div");
    this.element = h("section.card.threshold", { hidden: "", "aria-label": "what was found" },
      h("div.card-head", {}, h("h2", {}, "Threshold"), this.chart.tools, this.state = h("span.note")),
      h("div.threshold-parts", {}, h("div", {}, this.found, this.sought, this.facts, this.notes), this.chart.element));
  }

  close() { this.chart.close(); }

  // `info`: the sweep from the server. `titled(name)`: function that returns the title of a key or of a result.
  draw(info, titled) {
    Object.assign(this, { info, titled });
    const { search } = info;
    this.element.hidden = false;
    const x = (values, between = " and ") => vector(values, search.unit, 4, between);
    const y = (value) => exact(value, search.result_unit, 4);
    const results = new Map(search.points.map((point) => [point.x, point.value]));
    const { bracket, curve } = search;
    this.state.textContent = search.over ? "" : goesOn(info) ? "goes on" : `no report since ${moment(info.reported)}: the command that selects the points has ended or lost its connection; the same command continues the sweep`;
    this.found.textContent = bracket ? x([(bracket[0] + bracket[1]) / 2, (bracket[1] - bracket[0]) / 2], " ± ") : search.over ? "not found" : "not bracketed yet";
    this.sought.textContent = `${titled(search.key)}${search.more.length ? ` and ${counted(search.more.length, "key")} with it` : ""}, where ${titled(search.result)} = ${y(search.threshold).replace(" ", "\u00a0")}`;
    const without = search.points.filter(({ problem }) => problem).length;
    const ends = (bracket ?? [search.low, search.high]).filter((end) => typeof results.get(end) === "number");
    const facts = [
      [bracket ? "bracket" : "range", x(bracket ?? [search.low, search.high], " to ")],
      ["result there", ends.length ? vector(ends.map((end) => results.get(end)), search.result_unit, 4, " to ") : ""],
      ["asked for", `bracket of ${exact(search.tolerance, search.unit, 4)}`],
      ["curve", curve ? `${curve.law}: ${curve.error === null ? exact(curve.limit, search.unit, 4) : x([curve.limit, curve.error], " ± ")}` : ""],
      ["constants", curve ? constants(curve) : ""],
      ["runs", `${search.points.length}${without ? `, ${without} without a result` : ""}`],
    ];
    this.sought.title = `${search.key}, ${search.result}`;
    this.facts.replaceChildren(...facts.filter(([, text]) => text).map(([name, text]) => h("div", {}, h("dt", {}, name), h("dd", {}, text))));
    this.notes.replaceChildren(...remarks(search, x).map((text) => h("p.hint", {}, text)));
    this.chart.draw(true);
  }

  option() {
    const { search } = this.info;
    const { points, curve, bracket, threshold, unit, result_unit: up } = search;
    const known = points.filter(({ value }) => value !== null);
    const size = (list) => Math.max(0, ...list.map(Math.abs));
    const scatter = (name, tone, list, more = {}) => ({ type: "scatter", name, data: list, symbolSize: 9, color: colour(tone), cursor: "pointer", z: 5, ...more });
    const across = axis(unit, size([search.low, search.high]), { scale: true, splitLine: { show: false } });
    const along = axis(up, size([...known.map(({ value }) => value), threshold]), { scale: true });
    const list = [
      ...(curve ? drawn(curve, up) : []),
      { ...scatter("runs", "line-0", known.map(({ x, value, run }) => [x, value, run])), ...marks(bracket, threshold) },
      scatter("run goes on", "soft", points.filter(({ value, problem }) => value === null && !problem).map(({ x, run }) => [x, threshold, run]), { symbol: "emptyCircle" }),
      crosses("no result", points.filter(({ problem }) => problem).map(({ x, run, problem }) => [x, threshold, run, problem])),
      ...(curve ? interval(curve, threshold) : []),
    ].filter(({ data }) => data.length);
    return {
      grid: { left: 72, right: 22, top: 58, bottom: 46 },
      legend: { ...common(true).legend, data: list.filter(({ name }) => name).map(({ name }) => name) },
      xAxis: { ...across, name: named(this.titled(search.key), across.name), nameLocation: "middle", nameGap: 28, nameTextStyle: { ...across.nameTextStyle, align: "center" } },
      yAxis: { ...along, name: named(this.titled(search.result), along.name), nameTextStyle: { ...along.nameTextStyle, align: "left" } },
      series: list, xName: `${search.key}${unit ? ` [${unit}]` : ""}`,
      tooltip: { trigger: "item", formatter: ({ value: [at, result, , problem], seriesName }) => `${exact(at, unit, 5)}\n${problem ?? (seriesName === "run goes on" ? seriesName : si(result, up, 4))}` },
    };
  }

  // Returns the table to save; values are in SI units, as in other saved tables.
  table() {
    const { search: { points, key, unit, result, result_unit: up } } = this.info;
    const head = (name, si_unit) => (si_unit ? `${name} [${si_unit}]` : name);
    return { head: [head(key, unit), head(result, up), "run", "problem"], rows: points.map(({ x, value, run, problem }) => [x, value, run, problem]) };
  }
}

const named = (name, unit) => (unit ? `${name}, ${unit}` : name);

function constants({ factor, exponent }) {
  return exponent === null ? `slope ${si(factor, "", 4)}` : `a = ${si(factor, "", 4)}, p = ${si(exponent, "", 4)}`;
}

// Returns remarks on the sweep, such as the reason of its end.
function remarks({ why, mixed, curve, bracket }, x) {
  const beyond = curve && bracket && (curve.limit < bracket[0] || curve.limit > bracket[1]);
  return [
    why && `Ended early: ${why}.`,
    mixed && `The threshold is crossed more than once between ${x(mixed)}: the result is not monotonic, or scatters. The first crossing is given.`,
    beyond && "The limit of the curve lies outside of the bracket, because the results near the bracket do not follow the law.",
  ].filter(Boolean);
}

// Marks in the chart: a horizontal line at the threshold, and a vertical band for the bracket.
function marks(bracket, threshold) {
  const quiet = { silent: true, animation: false, label: { show: false } };
  return {
    markLine: { ...quiet, symbol: "none", lineStyle: { color: colour("soft"), type: "dashed", width: 1.2 }, data: [{ yAxis: threshold }] },
    ...(bracket ? { markArea: { ...quiet, itemStyle: { color: colour("accent"), opacity: 0.16 }, data: [[{ xAxis: bracket[0] }, { xAxis: bracket[1] }]] } } : {}),
  };
}

// Returns the series of the fitted curve in the band of its standard error.
function drawn({ law, course }, unit) {
  const line = series({ name: law, unit, colour: "line-1", data: course.map(([x, y]) => [x, y]), width: 1.6 });
  const banded = course.filter(([, , error]) => error !== null);
  const edge = (data) => ({ type: "line", data, stack: "band", stackStrategy: "all", symbol: "none", silent: true, lineStyle: { width: 0 }, tooltip: { show: false } });
  return [...(banded.length ? [edge(banded.map(([x, y, error]) => [x, y - error])), { ...edge(banded.map(([x, , error]) => [x, 2 * error])), areaStyle: { color: colour("line-1"), opacity: 0.2 } }] : []), line];
}

// Returns the series of the limit of the curve with its standard error.
function interval({ limit, error }, threshold) {
  const bar = { ...series({ name: "", colour: "line-1", data: [[limit - error, threshold], [limit + error, threshold]], width: 2.5 }), silent: true, z: 6, showSymbol: true, symbol: "rect", symbolSize: [2.5, 13] };
  return [...(error === null ? [] : [bar]), { type: "scatter", name: "limit of the curve", data: [[limit, threshold]], symbol: "diamond", symbolSize: 11, color: colour("line-1"), z: 7 }];
}
