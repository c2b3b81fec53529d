// Table of runs as an element: sortable columns, visible rows, groups, marks.

import { counted, exact, duration, h, meter, pill } from "./figures.js";
import { FINAL } from "./live.js";
import { detail, share } from "./columns.js";
import { Windowed } from "./windowed.js";

const TALL = { wide: 34, narrow: 108 }; // Height of a table row, px; runs.css has the same values.
const SAMPLED = 200; // Number of rows from which the width of a column is computed.
const LETTERS = [7, 30]; // Smallest and largest width of a column in characters.
const BOX = 38; // Width of the column of marks, px.
const BAR = 18; // Width of a scroll bar, px.
const FIELDS = 5; // Number of values of a run that a narrow window shows.
const NARROW = matchMedia("(max-width: 760px)");

export class Grid {
  // `on` has the callbacks { sort(column), mark(row, on, far), markAll(rows, on), toggle(group) }.
  constructor(label, on) {
    Object.assign(this, { on, columns: [], marked: new Set(), shorts: new Map() });
    this.head = h("thead");
    this.widths = h("colgroup");
    this.region = h("div.rows-view", { tabindex: 0, role: "region", "aria-label": label });
    this.rows = new Windowed(this.region, (item) => this.row(item), () => (NARROW.matches ? TALL.narrow : TALL.wide));
    this.table = h("table.runs", { "aria-label": label }, this.widths, this.head, this.rows.body);
    this.region.append(this.table);
    NARROW.addEventListener("change", this.redraw = () => this.rows.again());
  }

  close() {
    this.rows.close();
    NARROW.removeEventListener("change", this.redraw);
  }

  // Draws the table. `items`: { row } or { group }, in order; `all`: all rows; a different `stamp` means that `all` has
  // changed.
  draw({ columns, sort, items, all, marked, shorts, stamp }) {
    Object.assign(this, { columns, marked, shorts, all, sorted: sort.id });
    this.drawHead(columns, sort);
    this.measure(columns, `${stamp} ${columns.map(({ id }) => id).join()}`);
    this.table.setAttribute("aria-rowcount", items.length + 1);
    const marks = [...marked].sort().join();
    this.rows.set(items, `${columns.map(({ id, unit }) => id + unit).join()} ${marks} ${NARROW.matches && sort.id}`);
  }

  drawHead(columns, sort) {
    const stamp = JSON.stringify([columns.map(({ id, title, unit }) => [id, title, unit]), sort]);
    const boxes = this.all.filter(({ id }) => this.marked.has(id)).length;
    if (this.everything) Object.assign(this.everything, { checked: boxes > 0 && boxes === this.all.length, indeterminate: boxes > 0 && boxes < this.all.length });
    if (stamp === this.headed) return;
    this.headed = stamp;
    const focus = document.activeElement?.dataset?.column;
    this.everything = h("input", { type: "checkbox", "aria-label": "mark all runs that are shown", onchange: ({ target }) => this.on.markAll(this.all, target.checked) });
    this.head.replaceChildren(h("tr", { "aria-rowindex": 1 }, h("th.mark", { scope: "col" }, this.everything), columns.map((column) => this.title(column, sort))));
    if (focus) this.head.querySelector(`[data-column="${CSS.escape(focus)}"]`)?.focus();
  }

  title(column, sort) {
    const here = sort.id === column.id;
    const button = h("button.sort", { type: "button", "data-column": column.id, title: column.full ?? column.title, onclick: () => this.on.sort(column) },
      h("span", {}, column.title), column.unit ? h("small", {}, column.unit) : "", h("i", { "aria-hidden": "true" }, here ? (sort.down ? "↓" : "↑") : ""));
    return h(`th${column.number ? ".right" : ""}${column.id === "run" ? ".first" : ""}`, { scope: "col", "aria-sort": here ? (sort.down ? "descending" : "ascending") : false }, button);
  }

  // Returns the columns that fit into the width; columns with the largest rank are left out first. Columns in `kept`
  // always stay.
  fitting(columns, kept, rows) {
    const all = columns.map((column, n) => ({ column, n, wide: width(column, sampled(rows)) }));
    let over = all.reduce((sum, { wide }) => sum + wide, 0) - this.room();
    const spare = all.filter(({ column: { id, rank } }) => !kept(id) && rank !== undefined && id !== "run" && id !== "state").sort((a, b) => b.column.rank - a.column.rank || b.n - a.n);
    const gone = new Set();
    for (const { n, wide } of spare) {
      if (over <= 0) break;
      gone.add(n);
      over -= wide;
    }
    return columns.filter((_, n) => !gone.has(n));
  }

  // Returns the width for columns in characters; a narrow window shows the values of a run below each other.
  room() {
    const wide = this.region.clientWidth || this.region.parentElement?.clientWidth;
    return NARROW.matches || !wide ? Infinity : (wide - BOX - BAR) / letterOf(this.table);
  }

  // Computes column widths that stay constant while the rows scroll.
  measure(columns, stamp) {
    const room = this.room();
    if (`${stamp} ${room}` === this.measured) return;
    this.measured = `${stamp} ${room}`;
    const some = sampled(this.all);
    const letters = columns.map((column) => width(column, some));
    const spare = Math.max(0, room - letters.reduce((sum, n) => sum + n, 0));
    columns.forEach(({ most }, n) => { if (most && spare < Infinity) letters[n] += Math.min(spare, Math.max(0, Math.max(...some.map(most)) + 2 - letters[n])); });
    this.widths.replaceChildren(h("col", { style: { width: `${BOX}px` } }), ...letters.map((n) => h("col", { style: { width: `${n}ch` } })));
    this.table.style.width = `max(100%, calc(${BOX}px + ${letters.reduce((sum, n) => sum + n, 0)}ch))`;
  }

  row(item) {
    return item.group ? this.groupRow(item.group) : this.runRow(item.row);
  }

  runRow(row) {
    const marked = this.marked.has(row.id);
    const box = h("input", { type: "checkbox", "data-marks": row.id, "aria-label": `mark ${row.name} ${this.shorts.get(row.id)}`, checked: marked && "" });
    box.addEventListener("click", (event) => this.on.mark(row, box.checked, event.shiftKey));
    return h(`tr${marked ? ".marked" : ""}`, { onclick: (event) => opened(event, `#/runs/${encodeURIComponent(row.id)}`) },
      h("td.mark", { onclick: (event) => event.stopPropagation() }, box), (NARROW.matches ? this.few(row) : this.columns).map((column) => this.cell(row, column)));
  }

  // Returns the columns of a row in a narrow window: the column of the sort order, some keys, then results, then other
  // columns.
  few(row) {
    const named = (...ids) => this.columns.filter(({ id }) => ids.includes(id));
    const own = this.columns.filter(({ id, text }) => !["run", "state", "submitted"].includes(id) && text(row));
    const kind = (name) => own.filter(({ id }) => id.startsWith(name));
    const order = [...kind(this.sorted), ...kind("value:").slice(0, 2), ...kind("result:"), ...own];
    return [...named("run", "state", "submitted"), ...[...new Set(order)].slice(0, FIELDS)];
  }

  cell(row, column) {
    if (column.id === "run") return h("td.first", {}, h("a.name", { href: `#/runs/${encodeURIComponent(row.id)}`, title: row.title }, column.text(row)), h("span.id", { title: row.id }, this.shorts.get(row.id)));
    if (column.id === "state") return h("td.state", {}, state(row));
    const text = column.text(row);
    const tone = column.id === "references" && row.references ? (row.missed.length ? ".bad" : ".good") : "";
    const title = column.id === "references" ? row.missed.join(", ") : column.number ? exact(column.value(row) ?? NaN) : text;
    const unsure = Boolean(text && column.unsure?.(row));
    const words = column.unit ? `${column.title}, ${column.unit}` : column.title;
    return h(`td${column.number ? ".right" : ""}${tone}${text ? "" : ".none"}${unsure ? ".unsure" : ""}`, { "data-name": words, title: text ? `${title}${unsure ? `, ${row.state.replaceAll("_", " ")}` : ""}` : false }, text);
  }

  groupRow({ key, title, brief = "", href, note, varied, rows, open }) {
    const marked = rows.filter(({ id }) => this.marked.has(id)).length;
    const box = h("input", { type: "checkbox", "aria-label": `mark the runs of ${title}`, onchange: ({ target }) => this.on.markAll(rows, target.checked) });
    Object.assign(box, { checked: marked === rows.length, indeterminate: marked > 0 && marked < rows.length });
    return h("tr.group", {}, h("td.mark", {}, box), h("td.first", { colspan: this.columns.length },
      h("button.turn", { type: "button", "aria-expanded": String(open), "aria-label": `${open ? "close" : "open"} ${title}`, onclick: () => this.on.toggle(key) }, open ? "▾" : "▸"),
      href ? h("a.name", { href }, title) : h("b.name", {}, title), h("span.id", {}, brief), h("span.note", {}, note || counted(rows.length, "run")), varied ? h("span.note", {}, varied) : ""));
  }
}

// A click on a row opens the run, except on a control inside of the row or while text is selected.
function opened(event, address) {
  if (event.target.closest("a, button, input") || String(getSelection?.() ?? "")) return;
  location.hash = address;
}

const heading = ({ title, unit }) => 0.9 * title.length + (unit ? 1 + 0.9 * unit.length : 0) + 2.5;

const sampled = (rows) => {
  const every = Math.max(1, Math.ceil(rows.length / SAMPLED));
  return rows.filter((_, i) => i % every === 0);
};

// Returns the width of a column in characters.
const width = (column, rows) => column.width ?? Math.min(LETTERS[1], Math.max(LETTERS[0], heading(column), ...rows.map(column.letters ?? ((row) => column.text(row).length)))) + 2;

// Returns the width of the digit 0 in an element, px, which is the unit ch of CSS.
function letterOf(element) {
  const ctx = (letterOf.ctx ??= document.createElement("canvas").getContext("2d"));
  const { fontSize, fontFamily } = getComputedStyle(element);
  ctx.font = `${fontSize} ${fontFamily}`;
  return ctx.measureText("0").width || 8;
}

function state(row) {
  const going = row.progress && !FINAL.has(row.state);
  const note = detail(row);
  return [pill(row.state), going ? h("span.bar", {}, meter(row.state, share(row))) : "",
    note ? h("span.note", { title: going && row.progress.eta > 0 ? `${duration(row.progress.eta)} left` : note }, note) : ""];
}
