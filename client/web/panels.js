// The parts of a run's page that are no charts: bars of the ranks, balance events, the log by rank, reference numbers.

import { clock, h, legend, si, words } from "./figures.js";
import { GROUPS } from "./live.js";

const MOST_RANKS = 24;

export class Ranks {
  constructor() {
    this.element = h("section.card.half");
  }

  draw({ load }) {
    const { groups = {}, totals = [] } = load ?? {};
    const longest = Math.max(...totals, 1e-300);
    const share = (rank) => (totals[rank] > 0 ? (groups.compute?.[rank] ?? 0) + (groups.contact?.[rank] ?? 0) : 0) / (totals[rank] || 1);
    const rows = totals.slice(0, MOST_RANKS).flatMap((_, rank) => {
      const pieces = Object.entries(groups).map(([name, seconds]) =>
        h("i", { title: `${name} ${si(seconds[rank], "s")}`, style: { width: `${(100 * seconds[rank]) / longest}%`, background: `var(--${name})` } }));
      return [h("span.who", {}, `rank ${rank}`), h("div.stack", {}, pieces), h("span.busy", {}, `${Math.round(100 * share(rank))} % busy`)];
    });
    const more = totals.length - MOST_RANKS;
    this.element.replaceChildren(
      h("div.card-head", {}, h("h2", {}, "Load of each rank"), more > 0 ? h("span.note", {}, `${totals.length} ranks, the first ${MOST_RANKS} shown`) : ""),
      totals.length ? h("div.ranks", {}, rows) : h("p.hint", {}, "waiting for the first numbers"),
      totals.length ? legend(GROUPS.filter((name) => groups[name]).map((name) => [name === "waiting" ? "waiting for other ranks" : name, name])) : "");
  }
}

// One balance event at a time: why, what each rank had and what it should have now, what it cost and what cuts have saved.
export class Balances {
  constructor(live) {
    this.live = live;
    this.place = null;
    this.element = h("section.card.half", { hidden: "", "aria-label": "balance events", tabindex: -1 });
  }

  open(place) {
    this.place = place;
    this.draw();
    this.element.focus();
  }

  draw() {
    const { balances } = this.live;
    this.element.hidden = !balances.length;
    const place = Math.min(balances.length - 1, this.place ?? balances.length - 1);
    if (!balances.length || this.drawn === `${place}/${balances.length}`) return;
    this.drawn = `${place}/${balances.length}`;
    const event = balances[place];
    const step = (words_, to) => h("button.quiet", { type: "button", disabled: to < 0 || to >= balances.length ? "" : false, onclick: () => this.open(to) }, words_);
    const entry = (name, value) => h("div", {}, h("dt", {}, name), h("dd", {}, value));
    this.element.replaceChildren(
      h("div.card-head", {}, h("h2", {}, `Balance ${place + 1} of ${balances.length}`), h("span.note", {}, step("Earlier", place - 1), " ", step("Later", place + 1))),
      h("p.told", {}, event.cause),
      h("dl.facts", {}, entry("time", si(event.t, "s")), entry("tets moved", String(event.tets)), entry("nodes moved", String(event.nodes)),
        entry("cost", si(event.cost, "s")), entry("saved before", si(event.saved, "s"))),
      bars("before, s a step", summed(event.before)), bars("predicted", event.predicted));
  }
}

const summed = (phases) => Object.values(phases).reduce((total, seconds) => seconds.map((value, rank) => value + (total[rank] ?? 0)), []);

function bars(title, values) {
  const most = Math.max(...values, 1e-300);
  const mean = values.reduce((total, value) => total + value, 0) / (values.length || 1);
  return h("div", {}, h("h3", {}, `${title}: slowest over mean ${(most / (mean || 1)).toFixed(2)}`),
    h("div.ranks", {}, values.slice(0, MOST_RANKS).flatMap((value, rank) => [h("span.who", {}, `rank ${rank}`),
      h("div.stack", {}, h("i", { style: { width: `${(100 * value) / most}%`, background: "var(--compute)" } })), h("span.busy", {}, si(value))])));
}

// Lines of one rank, or of all, by tabs that arrow keys move between.
export class Logs {
  constructor(live) {
    Object.assign(this, { live, rank: null, logged: "" });
    this.tabs = h("div.tabs", { role: "tablist", "aria-label": "log of", onkeydown: (event) => this.key(event) });
    this.lines = h("pre.log", { id: "log-lines", tabindex: 0, role: "tabpanel", "aria-label": "log" });
    this.element = h("section.card.half", {}, h("div.card-head", {}, h("h2", {}, "Log"), this.tabs), this.lines);
  }

  choose(rank) {
    this.rank = rank;
    this.draw();
    this.tabs.querySelector("[aria-selected=true]")?.focus();
  }

  key(event) {
    const ranks = [null, ...this.live.logs.keys()];
    const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (move) this.choose(ranks.at((ranks.indexOf(this.rank) + move) % ranks.length));
  }

  draw() {
    const { logs } = this.live;
    const lines = this.rank === null ? [...logs.values()].flat().sort((a, b) => a.seq - b.seq) : logs.get(this.rank) ?? [];
    const state = `${this.rank} ${logs.size} ${lines.at(-1)?.seq}`;
    if (this.logged === state) return;
    this.logged = state;
    const tab = (rank) => h("button.tab", { type: "button", role: "tab", "aria-controls": "log-lines", "aria-selected": String(rank === this.rank),
      tabindex: rank === this.rank ? 0 : -1, onclick: () => this.choose(rank) }, rank === null ? "all" : `rank ${rank}`);
    this.tabs.replaceChildren(tab(null), ...[...logs.keys()].sort((a, b) => a - b).map(tab));
    const atEnd = this.lines.scrollTop + this.lines.clientHeight >= this.lines.scrollHeight - 8;
    this.lines.replaceChildren(...(lines.length ? lines.map((entry) =>
      h(`div.${entry.level}`, {}, h("time", {}, clock(entry.wall)), `  [${entry.rank ?? 0}] ${entry.text}`)) : [h("span.hint", {}, "nothing yet")]));
    if (atEnd) this.lines.scrollTop = this.lines.scrollHeight;
  }
}

export function checksTable(checks) {
  const exact = (value, unit) => `${Number(value?.toPrecision(5))} ${unit ?? ""}`.trim();
  return [h("div.card-head", {}, h("h2", {}, "Against the reference")), h("div.scroll", { tabindex: 0 }, h("table.checks", {},
    h("thead", {}, h("tr", {}, ["quantity", "computed", "expected", "tolerance", "result", "source"].map((name) => h("th", { scope: "col" }, words(name))))),
    h("tbody", {}, checks.map((check) => h("tr", {},
      h("td", {}, check.name),
      ...[exact(check.value, check.unit), exact(check.expected, check.unit), `± ${exact(check.tolerance, check.unit)}`].map((text) => h("td.number", {}, text)),
      h(`td.${check.pass ? "good" : "bad"}`, {}, check.pass ? "agrees" : "differs"),
      h("td.hint", {}, check.source ?? ""))))))];
}
