// Table of the compared runs: keys and results that differ, sortable by any column.

import { h, pill } from "./figures.js";
import { swatch } from "./linestyles.js";
import { save, toCsv } from "./tables.js";

const MOST_KEYS = 12;
const WHICH = { last: "last value", least: "least value", most: "greatest value" };

export class ResultTable {
  constructor() {
    Object.assign(this, { by: null, down: false, all: false });
    this.which = h("select", { "aria-label": "of probes", onchange: () => this.draw() }, Object.entries(WHICH).map(([value, words]) => h("option", { value }, `probes: ${words}`)));
    this.place = h("div.scroll", { tabindex: 0, role: "region", "aria-label": "values and results" });
    this.note = h("p.hint", { hidden: "" });
    const csv = h("button.tab", { type: "button", "aria-label": "save as CSV: values and results", onclick: () => this.save() }, "CSV");
    this.element = h("section.card", { hidden: "" }, h("div.card-head", {}, h("h2", {}, "Values that differ, and results"), h("span.beside", {}, this.which, h("span.save", {}, csv))), this.place, this.note);
  }

  // `rows`: { name, href, line, state } of each run. `keys`: columns of the keys that differ. `results` returns the
  // columns of results.
  draw(rows = this.rows, keys = this.keys, results = this.results) {
    Object.assign(this, { rows, keys, results });
    this.element.hidden = false;
    this.columns = [...keys.slice(0, MOST_KEYS), ...results(this.which.value || "last")];
    const more = keys.slice(MOST_KEYS);
    this.note.hidden = !more.length;
    this.note.textContent = `These keys also differ: ${more.map(({ key }) => key).join(", ")}.`;
    const order = this.order();
    const head = this.columns.map((column) => this.head(column));
    const focused = document.activeElement?.dataset?.sorts;
    this.place.replaceChildren(h("table.checks.outcomes", {}, h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "run"), head)),
      h("tbody", {}, order.map((i) => h("tr", {}, h("th.named", { scope: "row" }, swatch(rows[i].line), h("a", { href: rows[i].href }, rows[i].name), rows[i].state === "succeeded" ? "" : pill(rows[i].state)),
        this.columns.map(({ values, text, key }) => h(key ? "td.value" : `td.number${this.unsure(i) ? ".unsure" : ""}`, {}, text(values[i]))))))));
    if (focused) this.place.querySelector(`[data-sorts="${CSS.escape(focused)}"]`)?.focus();
  }

  head({ title, unit, key }) {
    const sorted = this.by === title ? (this.down ? "descending" : "ascending") : "none";
    const mark = { ascending: " ▲", descending: " ▼", none: "" }[sorted];
    return h(`th${key ? "" : ".number"}`, { scope: "col", "aria-sort": sorted }, h("button.by-column", { type: "button", "data-sorts": title, title: key ?? false, onclick: () => this.sort(title) }, title, unit ? h("small", {}, ` ${unit}`) : "", mark));
  }

  sort(title) {
    Object.assign(this, { down: this.by === title && !this.down, by: title });
    this.draw();
  }

  // The result of a run without success belongs to a time before the end of the run.
  unsure(i) { return this.rows[i].state !== "succeeded"; }

  // Returns the order of the rows. Missing values are last, preceded by results of runs without success.
  order() {
    const places = this.rows.map((_, i) => i);
    const column = this.columns.find(({ title }) => title === this.by);
    if (!column) return places;
    const value = (i) => column.values[i];
    const missing = (one) => one === null || one === undefined;
    return places.sort((i, j) => {
      const [one, other] = [value(i), value(j)];
      if (missing(one) || missing(other)) return missing(one) - missing(other);
      if (!column.key && this.unsure(i) !== this.unsure(j)) return this.unsure(i) - this.unsure(j);
      const less = typeof one === "number" && typeof other === "number" ? one - other : String(one).localeCompare(String(other), undefined, { numeric: true });
      return this.down ? -less : less;
    });
  }

  save() {
    const head = ["run", ...this.columns.map(({ title, si: unit }) => (unit ? `${title} [${unit}]` : title))];
    save("compared.csv", toCsv(head, this.rows.map(({ name }, i) => [name, ...this.columns.map(({ values }) => values[i])])), "text/csv");
  }
}
