// Page that compares several runs: their histories in common charts, keys that differ, results, bodies side by side.

import { axis, largest, lineStyle, logarithmic, series, time } from "./axes.js";
import { unanswered } from "./away.js";
import { binary, call, refused } from "./api.js";
import { Chart } from "./charts.js";
import { called, common, differences, inWords, keyColumns, results } from "./differences.js";
import { count, h, pill } from "./figures.js";
import { everyLine, readColumns, readPlan } from "./history.js";
import { swatch } from "./linestyles.js";
import { FINAL } from "./live.js";
import { fitted } from "./plots.js";
import { recall, remember } from "./storage.js";
import { ResultTable } from "./resulttable.js";
import { SideBySide } from "./sidebyside.js";
import { decode } from "./snapshot.js";

const TALL = 260;
const AGAIN = 5000; // Time in ms after which open runs, and runs without an answer, are read again.
const POINTS = 600; // Number of points of a line; up to twelve lines are drawn in a chart.
const REPORTS = 200; // Number of points of a line that is made from reports of a run.
const AT_ONCE = 4; // Number of runs that are read at the same time.
const MOST_CHARTS = 8;
const LEDGER = ["kinetic", "elastic", "plastic", "viscous", "contact", "friction", "eroded", "fracture", "cohesive", "external", "residual"];
const JOURNAL = { fragments: "", nodes: "", imbalance: "" }; // Quantities in the reports of a run, with their units.

export class ComparePage {
  constructor(ids, again = AGAIN) {
    Object.assign(this, { ids, again, runs: [], hidden: new Set(), charts: [], abort: new AbortController() });
    this.head = h("section.card", {}, h("h1", {}, `${ids.length} runs`), h("p.hint", {}, "Loading …"));
    this.grid = h("div.cards.charts");
    this.sheet = new ResultTable();
    this.bodies = new SideBySide();
    this.sizes = new Chart(TALL, "number of fragments of a size and larger, of each run", () => this.ofSizes(), { alone: true, name: () => "fragment_sizes", table: undefined });
    this.toBodies = jump("Bodies", this.bodies.element);
    this.toBodies.hidden = true;
    this.element = h("div.work", {}, this.head, this.grid, this.sheet.element, this.bodies.element);
    document.title = `${ids.length} runs · Conoid`;
    this.read();
  }

  close() {
    this.abort.abort();
    clearTimeout(this.timer);
    this.bodies.close();
    for (const { chart } of [...this.charts, { chart: this.sizes }]) chart.close();
  }

  // Reading ----------------------------------------------------------------------------------------------------------

  async read() {
    const { signal } = this.abort;
    try {
      const known = new Map(this.runs.map((run) => [run.id, run]));
      const todo = this.ids.filter((id) => !known.has(id) || !FINAL.has(known.get(id).info.state));
      await inTurn(todo, AT_ONCE, async (id) => { known.set(id, { ...known.get(id), ...(await readRun(id, signal)) }); });
      this.runs = this.ids.map((id) => known.get(id));
      this.units ??= await readUnits(this.runs[0].plan?.name, signal);
    } catch (error) {
      if (signal.aborted) return;
      this.head.replaceChildren(h("h1", {}, `${this.ids.length} runs`), h("p.problem", {}, refused(error) ? error.message : unanswered(error, this.drawn ? "The runs are shown as they were read last." : "", this.again)));
      if (!refused(error)) this.later();
      return;
    }
    if (signal.aborted) return;
    this.draw();
    this.readSnapshots();
    if (this.runs.some(({ info }) => !FINAL.has(info.state))) this.later();
  }

  later() {
    this.timer = setTimeout(() => this.read(), this.again);
  }

  // Reads the last snapshot of each run, for the sizes of its fragments; snapshots are read after the histories.
  async readSnapshots() {
    const { signal } = this.abort;
    await inTurn(this.runs, AT_ONCE, async (run) => {
      const path = `v1/runs/${encodeURIComponent(run.id)}/snapshots`;
      run.snapshots = (await call(path, { signal })).snapshots;
      const last = run.snapshots.at(-1);
      if (last && run.snapshot?.header.n !== last.n) run.snapshot = decode(await binary(`${path}/${last.n}`, { signal }));
    }).catch(() => {});
    if (signal.aborted) return;
    const broken = this.runs.some(({ snapshot }) => snapshot && fitted(snapshot).points.length > snapshot.header.parts.length);
    if (broken && !this.sizes.placed) this.grid.append(this.sizes.placed = this.card("Fragments of a size and larger, without dust", this.sizes.tools, this.sizes.element));
    this.sizes.draw();
    this.toBodies.hidden = !this.runs.some(({ snapshots }) => snapshots?.length);
    this.bodies.offer(this.runs.flatMap(({ id, snapshots }, line) => (snapshots?.length ? [{ id, snapshots, line, called: this.names[line], plan: this.runs[line].plan }] : [])));
  }

  // Quantities -------------------------------------------------------------------------------------------------------

  get key() { return `compare.${this.runs[0]?.plan?.name ?? ""}`; }

  // Returns the quantities that all runs have, by group: { group: [name, …] }.
  offered() {
    const columns = common(this.runs.map(({ columns: { units } }) => Object.keys(units)));
    const probes = common(this.runs.map(({ plan }) => (plan?.probes ?? []).map(({ name }) => name))).filter((name) => columns.includes(name));
    const energy = LEDGER.filter((name) => columns.includes(name) && !probes.includes(name));
    const parts = columns.filter((name) => /^(kinetic|internal)\./.test(name));
    const rest = columns.filter((name) => ![...probes, ...energy, ...parts, "t", "step", "initial"].includes(name));
    return { Probes: probes, "Energy, J": energy, "Energy of parts, J": parts, "Reports": Object.keys(JOURNAL), Others: rest };
  }

  chosen() {
    const { Probes: probes, ...rest } = this.offered();
    const all = [...probes, ...Object.values(rest).flat()];
    const kept = recall(this.key, []).filter((name) => all.includes(name));
    if (kept.length) return kept;
    const broken = this.runs.some(({ info }) => (info.outcome?.fragments ?? 0) > 2);
    return [...probes.slice(0, broken ? 2 : 3), "kinetic", ...(broken ? ["fragments"] : []), "residual"].filter((name) => all.includes(name)).slice(0, 5);
  }

  // Drawing ----------------------------------------------------------------------------------------------------------

  draw() {
    this.differing = differences(this.runs.map(({ plan }) => plan));
    this.names = called(this.runs, this.differing, this.units);
    this.drawHead();
    if (!this.drawn) for (const name of this.chosen()) this.addChart(name);
    this.drawn = true;
    this.sheet.draw(this.runs.map((run, i) => ({ name: this.names[i], href: `#/runs/${encodeURIComponent(run.id)}`, line: i, state: run.info.state })), keyColumns(this.differing, this.runs[0].plan, this.units), (which) => results(this.runs, which));
    this.fill(this.charts);
  }

  drawHead() {
    const focused = document.activeElement?.dataset?.run;
    const cases = [...new Set(this.runs.map(({ info }) => info.title || info.name))];
    this.head.replaceChildren(
      h("div.card-head", {}, h("h1", {}, `${this.runs.length} runs`), h("span.hint", {}, cases.length === 1 ? cases[0] : ""), h("span.note.jumps", {}, this.adder(), jump("Values", this.sheet.element), this.toBodies)),
      h("div.run-lines", { role: "group", "aria-label": "runs; press to hide or show" }, this.runs.map((run, i) => this.entry(run, i))));
    if (focused) this.head.querySelector(`[data-run="${CSS.escape(focused)}"]`)?.focus();
  }

  entry({ id, info }, i) {
    const light = (name) => { for (const { chart } of this.charts) chart.highlight(name); };
    const names = this.names;
    return h("span.run-line", {},
      h("button.tab", { type: "button", "data-run": id, "aria-pressed": String(!this.hidden.has(id)), title: `${info.title || info.name}, ${id}`, onclick: () => this.toggle(id),
        onmouseenter: () => light(names[i]), onmouseleave: () => light(null), onfocus: () => light(names[i]), onblur: () => light(null) }, swatch(i), names[i]),
      FINAL.has(info.state) && info.state === "succeeded" ? "" : pill(info.state), h("a.open-run", { href: `#/runs/${encodeURIComponent(id)}`, "aria-label": `open ${names[i]}` }, "open"));
  }

  toggle(id) {
    if (!this.hidden.delete(id)) this.hidden.add(id);
    this.head.querySelector(`[data-run="${CSS.escape(id)}"]`).setAttribute("aria-pressed", String(!this.hidden.has(id)));
    for (const { chart } of this.charts) chart.draw();
    this.sizes.draw();
  }

  adder() {
    return h("button.quiet", { type: "button", onclick: () => {
      const all = Object.values(this.offered()).flat();
      this.addChart(all.find((name) => !this.charts.some((one) => one.name === name)) ?? all[0]);
      this.keep();
    } }, "Add a chart");
  }

  card(title, beside, ...content) {
    return h("section.card", { "aria-label": title }, h("div.card-head", {}, h("h2", {}, title), h("span.beside", {}, beside)), ...content);
  }

  addChart(name) {
    if (this.charts.length >= MOST_CHARTS) return;
    const made = { name };
    const list = h("select", { "aria-label": "quantity", onchange: () => {
      made.name = list.value;
      made.chart.rename(about(made.name));
      this.keep();
      this.fill([made]);
    } }, Object.entries(this.offered()).filter(([, names]) => names.length).map(([group, names]) =>
      h("optgroup", { label: group }, names.map((one) => h("option", { value: one, selected: one === name ? "" : false }, inWords(one))))));
    made.chart = new Chart(TALL, about(name), () => this.overlaid(made.name), { name: () => `compared_${made.name}`, table: () => this.table(made.name) });
    const shut = h("button.tool.shut", { type: "button", "aria-label": "close this chart", onclick: () => {
      made.chart.close();
      made.element.remove();
      this.charts = this.charts.filter((one) => one !== made);
      this.keep();
    } });
    made.element = h("section.card", { "data-card": "", "aria-label": "chart" }, h("div.card-head", {}, list, h("span.beside", {}, made.chart.tools), h("span.tools", {}, shut)), made.chart.element);
    this.charts.push(made);
    this.grid.insertBefore(made.element, this.sizes.placed ?? null);
    if (this.drawn) this.fill([made]);
  }

  keep() { remember(this.key, this.charts.map(({ name }) => name)); }

  // Reads missing data of the visible charts, and draws these charts.
  async fill(charts) {
    const { signal } = this.abort;
    const names = charts.map(({ name }) => name);
    await inTurn(this.runs, AT_ONCE, async (run) => {
      const lacking = names.filter((name) => !(name in JOURNAL) && name in run.columns.units && !(name in run.curves));
      const { values } = lacking.length ? await readColumns(run.id, lacking, POINTS, signal) : {};
      for (const name of lacking) run.curves[name] = { t: values.t, values: values[name] };
      if (names.some((name) => name in JOURNAL && !(name in run.curves))) await readReports(run, signal);
    }).catch(() => {});
    if (!signal.aborted) for (const { chart } of charts) chart.draw();
  }

  overlaid(name) {
    const unit = JOURNAL[name] ?? this.runs.map(({ columns }) => columns.units[name]).find((one) => one !== undefined) ?? "";
    const ends = this.runs.map(({ plan, columns }) => plan?.run?.end_time ?? columns.extremes.t?.last ?? 0);
    const log = name === "fragments" || name === "nodes" || name === "residual";
    const list = this.runs.flatMap((run, i) => {
      const data = points(run, name).filter(([, value]) => !log || value > 0);
      const { colour, dash } = lineStyle(i);
      return data.length && !this.hidden.has(run.id) ? [{ ...series({ name: this.names[i], unit, colour, dash, width: 1.6, data }), z: 3 }] : [];
    });
    if (!list.length) return this.hidden.size ? empty(ends) : null;
    return { legend: { show: false }, grid: { left: 64, right: 14, top: 26, bottom: 26 },
      xAxis: time(Math.max(...ends)), yAxis: log ? logarithmic(unit) : axis(unit, largest(list), { scale: true }), series: list };
  }

  // Returns all lines of all runs in one table.
  async table(name) {
    const unit = this.runs.map(({ columns }) => columns.units[name]).find((one) => one !== undefined) ?? "";
    const each = await Promise.all(this.runs.map(async (run) => (name in JOURNAL ? points(run, name) : (await everyLine(run.id, [name])).rows)));
    return { head: ["run", "t [s]", unit ? `${name} [${unit}]` : name], rows: each.flatMap((rows, i) => rows.map((row) => [this.runs[i].id, ...row])) };
  }

  ofSizes() {
    const list = this.runs.flatMap(({ id, snapshot }, i) => {
      const data = snapshot && !this.hidden.has(id) ? fitted(snapshot).points : [];
      const { colour, dash } = lineStyle(i);
      return data.length > 1 ? [{ ...series({ name: this.names[i], unit: "", colour, dash, data, text: count }), step: "end", sampling: undefined }] : [];
    });
    if (!list.length) return null;
    return { legend: { show: false }, grid: { left: 64, right: 14, top: 26, bottom: 26 }, xName: "size [m]", xAxis: logarithmic("m", { splitLine: { show: false } }), yAxis: logarithmic("", { min: 1, axisLabel: { formatter: count } }), series: list };
  }
}

const about = (name) => `${inWords(name)} of all runs over time`;

// Returns a button that scrolls to a card further down.
const jump = (name, card) => h("button.quiet", { type: "button", "aria-label": `${name}: go to the card`, onclick: () => {
  card.tabIndex = -1;
  card.scrollIntoView({ block: "start" });
  card.focus({ preventScroll: true });
} }, `${name} ↓`);

const empty = (ends) => ({ xAxis: time(Math.max(...ends)), yAxis: axis("", 1), series: [] });

// Returns the points [[t, value]] of a quantity of a run.
function points({ curves }, name) {
  const { t = [], values = [] } = curves[name] ?? {};
  return t.map((at, i) => [at, values[i]]);
}

async function readReports(run, signal) {
  const { series: { t, ...series } } = await call(`v1/runs/${encodeURIComponent(run.id)}/history?points=${REPORTS}`, { signal });
  for (const name of Object.keys(JOURNAL)) run.curves[name] = { t, values: series[name] ?? [] };
}

async function readRun(id, signal) {
  const path = `v1/runs/${encodeURIComponent(id)}`;
  const [info, plan, columns] = await Promise.all([call(path, { signal }), readPlan(id, signal), readColumns(id, [], POINTS, signal)]);
  return { id, info, plan, columns, curves: {} };
}

// Returns the units of the keys of a case, by key.
async function readUnits(name, signal) {
  if (!name) return {};
  const { cases = [] } = await call(`v1/table?limit=1&case=${encodeURIComponent(name)}`, { signal }).catch(() => ({}));
  return cases[0]?.units ?? {};
}

// Calls `work` for each item of a list, for `atOnce` items at the same time.
async function inTurn(list, atOnce, work) {
  const left = [...list];
  await Promise.all(Array.from({ length: atOnce }, async () => {
    while (left.length) await work(left.shift());
  }));
}
