// Two runs on one page: the keys that differ, their histories over each other, what became of their fragments.

import { binary, call, refused } from "./api.js";
import { Chart, axis, series, time } from "./charts.js";
import { count, duration, fixed, h, number, pill, rough, si } from "./figures.js";
import { readPlan } from "./history.js";
import { FINAL } from "./live.js";
import { card } from "./plots.js";
import { decode, sizes } from "./snapshot.js";

const TALL = 250;
const AGAIN = 5000; // ms until runs that go on, or of which nobody answered, are read again.
const POINTS = 1000;
const TONES = ["compute", "bad"];
const NEVER = /^(name|title|description|reference\b.*)$/; // Keys that change no answer.

export class PairPage {
  constructor(runs, again = AGAIN) {
    Object.assign(this, { runs, again, told: [], abort: new AbortController() });
    this.charts = charts(this);
    this.head = h("div.card", {}, h("p.hint", {}, "Loading …"));
    this.keys = h("section.card.wide", { hidden: "" });
    this.table = h("section.card.half", { hidden: "" });
    this.element = h("div", {}, this.head, h("div.cards", {}, this.keys,
      this.charts.map(([title, chart]) => card(title, h("span.note"), chart.element)), this.table));
    document.title = "Two runs · Conoid";
    this.read();
  }

  close() {
    this.abort.abort();
    clearTimeout(this.timer);
    for (const [, chart] of this.charts) chart.close();
  }

  async read() {
    const { signal } = this.abort;
    try {
      this.told = await Promise.all(this.runs.map((run) => readRun(run, signal)));
    } catch (error) {
      if (signal.aborted) return;
      this.head.replaceChildren(h("p.problem", {}, refused(error) ? error.message : `No answer from the server: ${error.message}`));
      if (!refused(error)) this.later();
      return;
    }
    if (signal.aborted) return;
    this.draw();
    if (this.told.some(({ info }) => !FINAL.has(info.state))) this.later();
  }

  later() {
    this.timer = setTimeout(() => this.read(), this.again);
  }

  draw() {
    const names = labels(this.told);
    this.head.replaceChildren(h("h1", {}, "Two runs"), ...this.told.map(({ info }, i) =>
      h("p.told", {}, h("i.key", { style: { background: `var(--${TONES[i]})` } }), h("a", { href: `#/runs/${encodeURIComponent(info.id)}` }, names[i]), " ", pill(info.state))));
    this.keys.hidden = this.table.hidden = false;
    this.keys.replaceChildren(h("div.card-head", {}, h("h2", {}, "Keys that differ")), differing(this.told, names));
    this.table.replaceChildren(h("div.card-head", {}, h("h2", {}, "At the end, or now")), facts(this.told, names));
    for (const [, chart] of this.charts) chart.draw();
  }
}

async function readRun(run, signal) {
  const path = `v1/runs/${encodeURIComponent(run)}`;
  const [info, plan, history] = await Promise.all([
    call(path, { signal }), readPlan(run, signal), call(`${path}/history?points=${POINTS}`, { signal })]);
  const last = history.snapshots.at(-1);
  return { info, plan, history, snapshot: last ? decode(await binary(`${path}/snapshots/${last.n}`, { signal })) : null };
}

// What a run is called: its name, with its id where both have the same.
function labels(told) {
  const names = told.map(({ info }) => info.name || info.id);
  return names[0] === names[1] ? told.map(({ info }, i) => `${names[i]} (${info.id})`) : names;
}

// { "run.ranks": 2, "parts[0].name": "steel", … } of a case with all defaults.
export function flat(value, key = "") {
  if (value === null || typeof value !== "object") return { [key]: value };
  const under = (name) => (Array.isArray(value) ? `${key}[${name}]` : key ? `${key}.${name}` : name);
  return Object.assign({}, ...Object.keys(value).map((name) => flat(value[name], under(name))));
}

// [key, value of the one, value of the other] of what two cases do not have in common.
export function differences(one, other) {
  const [a, b] = [flat(one ?? {}), flat(other ?? {})];
  const keys = [...new Set([...Object.keys(a), ...Object.keys(b)])];
  return keys.filter((key) => (a[key] ?? null) !== (b[key] ?? null) && !NEVER.test(key)).map((key) => [key, a[key], b[key]]);
}

const shown = (value) => (value === undefined || value === null ? "–" : typeof value === "number" ? number(value) : String(value));

function differing(told, names) {
  if (told.some(({ plan }) => !plan)) return h("p.hint", {}, "a case is not written yet");
  const found = differences(told[0].plan, told[1].plan);
  if (!found.length) return h("p.hint", {}, "none: the same case");
  return sheet(["key", ...names], found.map(([key, ...values]) => [key, ...values.map(shown)]));
}

const sheet = (head, rows) => h("div.scroll", { tabindex: 0, role: "region", "aria-label": head[0] }, h("table.checks", {},
  h("thead", {}, h("tr", {}, head.map((name) => h("th", { scope: "col" }, name)))),
  h("tbody", {}, rows.map(([name, ...values]) => h("tr", {}, h("th.row", { scope: "row" }, name), values.map((value) => h("td", {}, value)))))));

function facts(told, names) {
  const all = told.map(statistics);
  return sheet(["quantity", ...names], Object.keys(all[0]).map((name) => [name, ...all.map((one) => one[name])]));
}

// What is compared at the end: words for people, of one run.
export function statistics({ info, history, snapshot }) {
  const last = (name) => history.series?.[name]?.at(-1);
  const { points = [], best } = snapshot ? sizes(snapshot) : {};
  const masses = snapshot ? [...snapshot.arrays.fragment_mass].filter((_, row) => snapshot.arrays.fragment_id[row] >= 0n) : [];
  const middle = points.length ? points[Math.floor(points.length / 2)][0] : undefined;
  const law = best ? `${best.law}, ${best.law === "power" ? `exponent ${fixed(best.parameter)}` : si(best.parameter, "m")}` : "–";
  return {
    state: info.state, time: si(last("t"), "s"), step: count(last("step")), elapsed: duration(history.elapsed), "energy residual": rough(last("residual")),
    kinetic: si(last("kinetic"), "J"), nodes: count(last("nodes") ?? undefined), fragments: count(snapshot?.header.fragments_total),
    "of 10 tets and more": snapshot ? count(points.length) : "–", "median size of these": si(middle, "m"), "law of their sizes": law,
    "heaviest fragment": si(masses.length ? masses.reduce((most, mass) => Math.max(most, mass), 0) : undefined, "kg"),
  };
}

// Charts ---------------------------------------------------------------------------------------------------------------

const LOST = ["elastic", "plastic", "viscous", "contact", "friction", "eroded", "fracture", "cohesive", "stepping", "averaging"];
const inside = (history) => history.series.t.map((_, i) => LOST.reduce((sum, name) => sum + (history.series[name]?.[i] ?? 0), 0));
const column = (name) => (history) => history.series[name] ?? [];

function charts(page) {
  const over = (title, values, unit, more = {}) => [title, new Chart(TALL, `${title} of both runs over time`, () => overlaid(page.told, values, unit, more))];
  return [
    over("Fragments", column("fragments"), "", { type: "log" }), over("Energy without the kinetic", inside, "J"),
    over("Time step", column("dt"), "s", { scale: true }), over("Load imbalance, slowest over mean", column("imbalance"), "", { min: 1 }),
    ["Fragment sizes", new Chart(TALL, "number of fragments of a size and more, of both runs", () => bothSizes(page.told), { alone: true })],
  ];
}

function overlaid(told, values, unit, more) {
  const known = told.filter(({ history }) => history.series?.t?.length);
  if (!known.length) return null;
  const names = labels(told);
  const end = Math.max(...known.map(({ info, history }) => info.progress?.end_time ?? history.series.t.at(-1)));
  return { xAxis: time(end), yAxis: axis(unit, more), series: told.flatMap(({ history }, i) => (history.series?.t?.length ? [series({ name: names[i], colour: TONES[i], unit,
    data: values(history).map((value, at) => [history.series.t[at], value]).filter(([, value]) => Number.isFinite(value) && (more.type !== "log" || value > 0)) })] : [])) };
}

function bothSizes(told) {
  const names = labels(told);
  const known = told.map(({ snapshot }) => (snapshot ? sizes(snapshot).points : []));
  if (!known.some((points) => points.length > 1)) return null;
  return { xAxis: axis("m", { type: "log", splitLine: { show: false } }), yAxis: axis("", { type: "log", min: 1 }),
    series: known.map((data, i) => ({ ...series({ name: names[i], colour: TONES[i], data }), type: "scatter", symbolSize: 4, sampling: undefined })),
    tooltip: { trigger: "item", formatter: ({ seriesName, value }) => `${seriesName}\n${count(value[1])} of ${si(value[0], "m")} and more` } };
}
