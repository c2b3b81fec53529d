// Page of a sweep: number of completed points, a result over the changed keys, and each point with its values.

import { Problem, call, download, refused } from "./api.js";
import { unanswered } from "./away.js";
import { axis, crosses, largest, lineStyle, series } from "./axes.js";
import { Chart } from "./charts.js";
import { columnsOf } from "./columns.js";
import { counted, exact, h, meter, pill, si, words } from "./figures.js";
import { Grid } from "./grid.js";
import { FINAL } from "./live.js";
import { sorted } from "./sorting.js";
import { recall, remember } from "./storage.js";
import { Answer, goesOn } from "./search.js";
import { curves, lost, matrix, telling, together } from "./response.js";
import { RunTable, shorts } from "./runtable.js";
import { fill } from "./toolbar.js";

const AGAIN = 2000; // Time in ms after which an open sweep is read again.
const LATER = 10000; // Time in ms after which an adaptive sweep is read again whose command may continue.
const TALL = 320;
const PAGE = 500;
const BRIEF = 9; // Number of characters of the id that are shown.

export class SweepPage {
  // `onRefused` is called when the token is no longer valid.
  constructor(id, onRefused) {
    Object.assign(this, { id, onRefused, table: new RunTable(), abort: new AbortController(), marked: new Set(), points: [], columns: [], sort: { id: "point", down: false } });
    this.path = `v1/sweeps/${encodeURIComponent(id)}`;
    this.build();
    document.title = "Sweep · Conoid";
    this.read();
  }

  close() {
    this.abort.abort();
    clearTimeout(this.timer);
    this.chart.close();
    this.answer.close();
    this.grid.close();
  }

  build() {
    this.title = h("h1", {}, "Sweep");
    this.brief = h("span.id", { title: this.id }, this.id.slice(0, BRIEF));
    this.how = h("span.note", { role: "status" }, "Loading …");
    this.bar = h("span");
    this.problem = h("p.problem", { role: "status", hidden: "" });
    this.tools = h("div.tools-row", { hidden: "" },
      this.compare = h("button", { type: "button", disabled: "", onclick: () => this.compareMarked() }, "Compare"),
      h("button.quiet", { type: "button", onclick: ({ currentTarget }) => this.csv(currentTarget) }, "CSV"),
      this.stop = h("button.stop", { type: "button", onclick: () => this.cancel() }, "Cancel the sweep"));
    this.failed = h("section.card", { hidden: "", "aria-label": "points that have failed" });
    this.result = h("select", { "aria-label": "result", onchange: ({ target }) => { remember(this.name("result"), target.value); this.drawResponse(); } });
    this.over = h("select", { "aria-label": "over", onchange: ({ target }) => { remember(this.name("over"), target.value); this.drawResponse(); } });
    this.chart = new Chart(TALL, "the result over the changed key", () => this.option(), { alone: true, name: () => `${this.info.name}-sweep`, onClick: ({ data }) => { if (data?.[2]) location.hash = `#/runs/${data[2]}`; } });
    this.squares = h("div.scroll", { tabindex: 0, role: "region", "aria-label": "matrix of two keys" });
    this.response = h("section.card", { hidden: "" },
      h("div.card-head", {}, h("h2", {}, "Response"), this.chart.tools, h("span.beside", {}, h("label.field", {}, "result", this.result), this.overLabel = h("label.field", {}, "over", this.over))),
      this.chart.element);
    this.map = h("section.card", { hidden: "" }, h("div.card-head", {}, h("h2", {}, "Matrix"), this.mapNote = h("span.note")), this.squares);
    this.grid = new Grid("points", { sort: (column) => this.sortBy(column), mark: (row, on) => this.mark([row], on), markAll: (rows, on) => this.mark(rows, on), toggle() {} });
    this.answer = new Answer();
    this.seen = h("div.seen", {}, this.response, this.map);
    this.element = h("div.sweep", {}, h("div.page-head", {}, this.title, this.brief, this.how, this.bar, h("span.grow"), this.tools), this.problem, this.answer.element, this.failed, this.seen, this.grid.region);
    this.grid.region.hidden = true;
  }

  // Returns the key under which choices are stored; it is the same for all sweeps of a case.
  name(what) { return `sweep.${what}.${this.info?.name}`; }

  async read() {
    const { signal } = this.abort;
    try {
      this.info = await call(this.path, { signal });
      let query = { limit: PAGE, sweep: this.id };
      let pending = 0;
      for (;;) {
        const answer = await call(`v1/table?${new URLSearchParams(query)}`, { signal });
        this.table.take(answer);
        pending += answer.pending;
        if (!answer.next) break;
        query = { ...query, cursor: answer.next };
      }
      this.pending = pending;
      this.draw();
    } catch (error) {
      if (signal.aborted) return;
      if (error instanceof Problem && error.status === 401) return this.onRefused();
      this.fail(refused(error) ? error.message : unanswered(error, this.info ? "The points are shown as they were read last." : "", AGAIN));
      if (refused(error)) return;
    }
    if (!this.finished || this.pending) this.timer = setTimeout(() => this.read(), this.pending ? 300 : AGAIN);
    else if (this.info.search && !this.info.search.over) this.timer = setTimeout(() => this.read(), LATER);
  }

  fail(words) {
    this.problem.hidden = !words;
    this.problem.textContent = words;
  }

  // Returns the number of points whose run has ended or was removed.
  get ended() { return Object.entries(this.info.states).reduce((sum, [state, n]) => sum + (FINAL.has(state) ? n : 0), this.info.removed); }

  get finished() {
    if (!this.info) return false;
    return this.info.search ? !goesOn(this.info) : this.ended === this.info.total;
  }

  draw() {
    const { info, table } = this;
    const there = info.points.filter(({ run }) => table.rows.has(run.id));
    this.points = there.map(({ values, run }, n) => ({ n, values, row: { ...table.rows.get(run.id), values: { ...table.rows.get(run.id).values } } }));
    const rows = this.points.map(({ row }) => row);
    this.place = new Map(this.points.map(({ n, row }) => [row.id, n]));
    this.keys = keyColumns(this.points, table.units);
    const others = columnsOf(rows, [], table.units).filter(({ id }) => !["run", "labels", "title", "submitted", "message"].includes(id));
    this.groups = together(this.points, this.keys);
    this.results = others.filter(({ id }) => id.startsWith("result:"));
    const point = { id: "run", title: "point", value: (row) => this.place.get(row.id), text: (row) => String(1 + this.place.get(row.id)), width: 16 };
    this.columns = [point, ...this.keys, ...others.filter(({ shown }) => shown)];
    this.columns = this.grid.fitting(this.columns, (id) => id.startsWith("value:"), rows);
    this.drawHead();
    if (this.info.search) this.answer.draw(this.info, (name) => this.titled(name));
    this.drawFailed();
    this.drawGrid();
    this.choices();
    this.drawResponse();
  }

  drawHead() {
    const { info, ended } = this;
    document.title = `${info.name} · sweep · Conoid`;
    this.title.textContent = `${info.search ? "Adaptive sweep" : "Sweep"} of ${info.name}`;
    const states = Object.entries(info.states).sort(([a], [b]) => (b === "succeeded") - (a === "succeeded")).map(([state, n]) => `${n} ${words(state)}`);
    this.how.textContent = `${info.search ? counted(info.total, "point") : `${ended} of ${counted(info.total, "point")} done`}: ${[...states, ...(info.removed ? [`${info.removed} removed`] : [])].join(", ")}`;
    this.bar.replaceChildren(this.finished || info.search ? "" : meter("running", ended / info.total));
    this.tools.hidden = false;
    this.stop.hidden = this.finished;
    this.fail("");
  }

  // Returns the title of a key or of a result, as in the table.
  titled(name) { return [...this.keys, ...this.results].find(({ full }) => full === name)?.title ?? name; }

  drawFailed() {
    const failed = this.points.filter(({ row }) => FINAL.has(row.state) && row.state !== "succeeded");
    this.failed.hidden = !failed.length;
    if (this.failed.number === failed.length) return; // The list stays unchanged, so that its links keep the focus.
    this.failed.number = failed.length;
    this.failed.replaceChildren(h("div.card-head", {}, h("h2", {}, `${counted(failed.length, "point")} without a result`)),
      h("ul", {}, failed.map(({ n, row }) => h("li", {}, pill(row.state), " ", h("a", { href: `#/runs/${row.id}` }, this.words(row, n)), " ", row.message || row.cause || ""))));
  }

  // Returns the text of a point: the values of its keys.
  words(row, n) {
    return this.keys.map((key) => `${key.title} ${key.text(row)}${key.unit ? ` ${key.unit}` : ""}`).join(", ") || `point ${n + 1}`;
  }

  drawGrid() {
    const rows = this.points.map(({ row }) => row);
    const column = this.columns.find(({ id }) => id === this.sort.id) ?? this.columns[0];
    const all = sorted(rows, column, this.sort.down);
    this.all = all;
    this.grid.region.hidden = !all.length;
    this.grid.draw({ columns: this.columns, sort: { ...this.sort, id: column.id }, items: all.map((row) => ({ key: row.id, content: row.content, row })), all, marked: this.marked, shorts: shorts(rows.map(({ id }) => id)), stamp: this.table.version });
    this.compare.disabled = this.marked.size < 2;
    this.compare.textContent = this.marked.size > 1 ? `Compare ${this.marked.size}` : "Compare";
    this.compare.title = this.marked.size > 1 ? "" : "mark two points or more";
  }

  sortBy({ id }) {
    this.sort = { id, down: this.sort.id === id && !this.sort.down };
    this.drawGrid();
  }

  mark(rows, on) {
    for (const { id } of rows) {
      if (on) this.marked.add(id);
      else this.marked.delete(id);
    }
    this.drawGrid();
  }

  compareMarked() {
    location.hash = `#/compare/${this.all.filter(({ id }) => this.marked.has(id)).map(({ id }) => id).join("/")}`;
  }

  async csv(button) {
    button.disabled = true;
    try {
      await download(`${this.path}/table`, `${this.info.name}-${this.id.slice(0, BRIEF)}.csv`, 0, () => {});
    } catch (error) {
      this.fail(error.message);
    }
    button.disabled = false;
  }

  async cancel() {
    if (!confirm("Cancel every run of this sweep that has not ended?")) return;
    try {
      await call(`${this.path}:cancel`, { method: "POST" });
    } catch (error) {
      this.fail(error.message);
    }
    clearTimeout(this.timer);
    this.read();
  }

  // The response -------------------------------------------------------------------------------------------------------

  choices() {
    // The threshold of an adaptive sweep has a chart of its own.
    const others = this.results.filter(({ id }) => id !== `result:${this.info.search?.result}`);
    const wanted = recall(this.name("result"), telling(this.points, others.length ? others : this.results)?.id);
    fill(this.result, this.results.map(({ id, full, title }) => [id, full ?? title]), wanted);
    fill(this.over, this.groups.map(({ id, full }) => [id, full]), recall(this.name("over"), this.groups[0]?.id));
    this.overLabel.hidden = this.groups.length < 2;
  }

  get chosen() { return this.results.find(({ id }) => id === this.result.value) ?? this.results[0]; }

  get axes() {
    const x = this.groups.find(({ id }) => id === this.over.value) ?? this.groups[0];
    return { x, others: this.groups.filter((key) => key !== x) };
  }

  drawResponse() {
    const there = this.results.length > 0 && this.keys.length > 0 && this.points.some(({ row }) => row.results);
    this.response.hidden = !there;
    this.map.hidden = !there || this.groups.length !== 2;
    this.seen.classList.toggle("two", !this.map.hidden);
    if (!there) return;
    this.chart.draw(true);
    if (!this.map.hidden) this.drawMatrix();
  }

  option() {
    const { x, others } = this.axes;
    const result = this.chosen;
    if (!x || !result) return null;
    const made = curves(this.points, x, others, result);
    const { words: places, curves: found } = made;
    const lines = found.map(({ name, data }, i) => ({ ...series({ name: name || result.title, data, unit: result.base, ...lineStyle(i) }), showSymbol: true, symbolSize: 8, cursor: "pointer" }));
    const titled = (column, scale) => ({ ...scale, name: scale.name ? `${column.named ?? column.title}, ${scale.name}` : column.named ?? column.title });
    const across = axis(x.base, Math.max(0, ...found.flatMap(({ data }) => data.map(([value]) => Math.abs(value)))), { scale: true, splitLine: { show: false } });
    const up = axis(result.base, largest(lines), { scale: true });
    return {
      grid: { left: 72, right: 22, top: found.length > 1 ? 58 : 36, bottom: 46 },
      xAxis: { ...titled(x, across), ...(places ? { type: "category", data: places, axisLabel: {} } : {}), nameLocation: "middle", nameGap: 28, nameTextStyle: { ...across.nameTextStyle, align: "center" } },
      yAxis: { ...titled(result, up), nameTextStyle: { ...up.nameTextStyle, align: "left" } },
      series: [...lines, crosses("no result", lost(this.points, made))], xName: x.base ? `${x.full} [${x.base}]` : x.full,
      ...(found.length > 1 ? {} : { legend: { show: false } }),
      tooltip: { trigger: "item", formatter: ({ seriesName, value }) => (value[3] ? `${x.title} ${places ? places[value[0]] : exact(value[0], x.base)}\n${value[3]}` : `${x.title} ${places ? places[value[0]] : exact(value[0], x.base)}\n${result.title} ${si(value[1], result.base, 4)}${found.length > 1 ? `\n${seriesName}` : ""}`) },
    };
  }

  drawMatrix() {
    const { x, others: [down] } = this.axes;
    const result = this.chosen;
    const { rows, columns, cells } = matrix(this.points, down, x, result);
    const unit = (column) => (column.unit ? `, ${column.unit}` : "");
    this.mapNote.textContent = `${result.full ?? result.title}${unit(result)}`;
    this.squares.replaceChildren(h("table.matrix", {},
      h("thead", {}, h("tr", {}, h("th", { scope: "col" }, `${down.named}${unit(down)} ↓  ${x.named}${unit(x)} →`), columns.map(({ text }) => h("th", { scope: "col" }, text)))),
      h("tbody", {}, rows.map(({ text }, i) => h("tr", {}, h("th", { scope: "row" }, text), cells[i].map((cell) => square(cell, result)))))));
  }
}

// Returns a cell of the matrix: its number on its colour, or the state of its run.
function square({ points, value, share }, result) {
  if (!points.length) return h("td");
  const { row } = points[0];
  const over = FINAL.has(row.state) && value === null;
  const link = h(`a${value === null ? (over ? ".failed" : ".open") : ""}`, { href: `#/runs/${row.id}`, title: row.message || false }, value === null ? words(row.state) : result.write(value));
  link.style.setProperty("--share", share ?? 0);
  return h("td", {}, link);
}

// Returns the keys of a sweep as columns. The values come from the case with all defaults, in SI units, if it has the
// key; otherwise they are as written by the user.
function keyColumns(points, units) {
  const rows = points.map(({ row }) => row);
  const keys = [...new Set(points.flatMap(({ values }) => Object.keys(values)))];
  const written = new Map(points.map(({ values, row }) => [row.id, values]));
  const known = keys.filter((key) => rows.every((row) => key in row.base || key in row.values));
  const columns = new Map(columnsOf(rows, known, units).filter(({ id }) => id.startsWith("value:")).map((column) => [column.full, column]));
  const text = (row, key) => { const value = written.get(row.id)[key]; return typeof value === "object" ? JSON.stringify(value) : String(value ?? ""); };
  return keys.map((key) => columns.get(key) ?? { id: `value:${key}`, title: key, full: key, value: (row) => text(row, key), text: (row) => text(row, key) });
}
