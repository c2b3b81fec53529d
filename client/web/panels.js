// Tables on the page of a run: bars of the ranks, balance events, reference numbers.

import { alike, count, exacts, fixed, h, legend, percent, si } from "./figures.js";
import { GROUPS } from "./live.js";
import { SPENT } from "./loads.js";

const MOST_RANKS = 24;

export class Ranks {
  constructor() {
    this.element = h("div");
    this.note = h("span.note");
  }

  draw({ load }) {
    const { groups = {}, totals = [], helped = [] } = load ?? {};
    const longest = Math.max(...totals, 1e-300);
    const share = (rank) => (totals[rank] > 0 ? (groups.compute?.[rank] ?? 0) + (groups.contact?.[rank] ?? 0) : 0) / (totals[rank] || 1);
    const rows = totals.slice(0, MOST_RANKS).flatMap((_, rank) => {
      const pieces = Object.entries(groups).map(([name, seconds]) =>
        h("i", { title: `${name} ${si(seconds[rank], "s")}`, style: { width: `${(100 * seconds[rank]) / longest}%`, background: `var(--${name})` } }));
      return [h("span.rank-name", {}, `rank ${rank}`), h("div.stack", {}, pieces), h("span.busy", {}, `${percent(share(rank), 0)} computes${rank in helped ? ` · other threads ${percent(helped[rank], 0)} busy` : ""}`)];
    });
    const more = totals.length - MOST_RANKS;
    this.note.textContent = more > 0 ? `${totals.length} ranks, the first ${MOST_RANKS} shown` : "";
    this.element.replaceChildren(
      totals.length ? h("div.ranks", {}, rows) : h("p.hint", {}, "Waiting for the first numbers."),
      totals.length ? legend(GROUPS.filter((name) => groups[name]).map((name) => [SPENT[name] ?? name, name])) : "");
  }
}

// Shows one balance event at a time: reason, work of each rank before and after the event, cost, and saved time.
export class Balances {
  // `onOpen` scrolls to the card of the balance events.
  constructor(live, onOpen) {
    Object.assign(this, { live, onOpen, place: null });
    this.element = h("div");
    this.title = h("span", {}, "Balance events");
    this.beside = h("span.note");
  }

  open(place) {
    this.place = place;
    this.draw();
    this.onOpen();
  }

  draw() {
    const { balances } = this.live;
    const place = Math.min(balances.length - 1, this.place ?? balances.length - 1);
    if (!balances.length || this.drawn === `${place}/${balances.length}`) return;
    this.drawn = `${place}/${balances.length}`;
    const event = balances[place];
    const step = (words_, to) => h("button.quiet", { type: "button", disabled: to < 0 || to >= balances.length ? "" : false, onclick: () => this.open(to) }, words_);
    const entry = (name, value) => h("div", {}, h("dt", {}, name), h("dd", {}, value));
    this.title.textContent = `Balance ${place + 1} of ${balances.length}`;
    this.beside.replaceChildren(step("Earlier", place - 1), " ", step("Later", place + 1));
    this.element.replaceChildren(
      h("p.message", {}, event.cause),
      h("dl.facts", {}, entry("time", si(event.t, "s")), entry("tets moved", count(event.tets)), entry("nodes moved", count(event.nodes)),
        entry("this cut took", si(event.cost, "s")), entry("earlier cuts saved", si(event.saved, "s"))),
      bars("Work of each rank in a step before the event", summed(event.before)), bars("Work expected after", event.predicted));
  }
}

const summed = (phases) => Object.values(phases).reduce((total, seconds) => seconds.map((value, rank) => value + (total[rank] ?? 0)), []);

function bars(title, values) {
  const most = Math.max(...values, 1e-300);
  const mean = values.reduce((total, value) => total + value, 0) / (values.length || 1);
  const texts = alike(values, "s");
  return h("div", {}, h("h3", {}, `${title}: slowest over mean ${fixed(most / (mean || 1))}`),
    h("div.ranks", {}, values.slice(0, MOST_RANKS).flatMap((value, rank) => [h("span.rank-name", {}, `rank ${rank}`),
      h("div.stack", {}, h("i", { style: { width: `${(100 * value) / most}%`, background: "var(--compute)" } })), h("span.busy", {}, texts[rank])])));
}

const COLUMNS = ["quantity", "computed", "expected", "tolerance", "result", "source"];

// In a narrow window each table row becomes several text lines with the names of the columns; ARIA roles keep the
// structure of a table.
const cell = (what, column, text) => h(what, { role: "cell", "data-name": COLUMNS[column] }, text);

export function checksTable(checks) {
  return h("div.scroll", { tabindex: 0 }, h("table.checks.stacked", { role: "table" },
    h("thead", { role: "rowgroup" }, h("tr", { role: "row" }, COLUMNS.map((name) => h("th", { scope: "col", role: "columnheader" }, name)))),
    h("tbody", { role: "rowgroup" }, checks.map((check) => h("tr", { role: "row" },
      cell("td", 0, check.name),
      exacts([check.value, check.expected, check.tolerance], check.unit).map((text, i) => cell("td.number", 1 + i, i < 2 ? text : `± ${text}`)),
      cell(`td.${check.pass ? "good" : "bad"}`, 4, check.pass ? "agrees" : "differs"),
      cell("td.hint", 5, check.source ?? ""))))));
}
