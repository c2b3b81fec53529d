// The page of one run: everything on it follows from the run's messages.

import { Problem, call, messages } from "./api.js";
import { Chart, areas, at, heat, line } from "./charts.js";
import { clock, count, duration, h, legend, meter, percent, pill, si } from "./figures.js";
import { FINAL, Live, TERMS } from "./live.js";

const MOST_RANKS = 24;
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export class RunPage {
  constructor(run) {
    this.live = new Live(run);
    this.info = {};
    this.outcome = null;
    this.abort = new AbortController();
    this.connection = ["waiting", "connecting"];
    this.due = false;
    this.build();
    this.timer = setInterval(() => this.later(), 1000);
    this.follow();
  }

  close() {
    this.abort.abort();
    clearInterval(this.timer);
  }

  build() {
    const { live } = this;
    const end = () => live.progress?.end_time ?? 1;
    this.head = h("div.card");
    this.ranks = h("div.card.half");
    this.checks = h("div.card.wide", { hidden: "" });
    this.ledgerLegend = h("div");
    this.residualNote = h("span.note");
    this.imbalanceNote = h("span.note");
    this.log = h("pre.log", { tabindex: 0, "aria-label": "log" });
    const ledger = () => live.ledger.map(({ t, energy }) => ({ t, values: TERMS.map(([name]) => energy[name]) }));
    const residuals = () => live.ledger.map(({ t, energy }) => ({ t, value: energy.residual }));
    const imbalances = () => live.loads.map(({ t, imbalance }) => ({ t, value: imbalance }));
    this.charts = [
      new Chart(230, "energy over time", (c, a) => areas(c, a, ledger(), TERMS.map(([, name]) => name), "J", end()),
        (share) => this.tellEnergy(share * end())),
      new Chart(230, "energy residual over time",
        (c, a) => line(c, a, residuals(), "accent", { end: end(), log: true, label: (power) => `1e${power}`, marks: [1e-2] }),
        (share) => this.tell(live.ledger, share * end(), (point) => [`residual ${point.energy.residual.toExponential(1)}`])),
      new Chart(150, "load imbalance over time",
        (c, a) => line(c, a, imbalances(), "exchange", { end: end(), floor: 1, label: (value) => value.toFixed(2) }),
        (share) => this.tell(live.loads, share * end(), (point) => [`imbalance ${point.imbalance.toFixed(3)}`])),
      new Chart(150, "busy share of every rank over time", (c, a) => heat(c, a, live.loads, end()),
        (share) => this.tell(live.loads, share * end(), (point) =>
          point.busy.slice(0, 8).map((busy, rank) => `rank ${rank}  ${percent(busy)} busy`))),
    ];
    const card = (title, note, ...content) =>
      h("section.card.half", {}, h("div.card-head", {}, h("h2", {}, title), note), ...content);
    const [energy, residual, imbalance, busy] = this.charts.map((chart) => chart.element);
    this.element = h("div", {},
      this.head,
      h("div.cards", {},
        this.checks,
        card("Energy", null, energy, this.ledgerLegend),
        card("Energy residual", this.residualNote, residual),
        this.ranks,
        card("Busy share, rank by time", null, busy),
        card("Load imbalance, slowest over mean", this.imbalanceNote, imbalance),
        h("section.card.half", {}, h("div.card-head", {}, h("h2", {}, "Log")), this.log)));
    this.draw();
  }

  // Messages -----------------------------------------------------------------------------------------------------

  async follow() {
    const { live } = this;
    let wait = 500;
    await this.readInfo();
    while (!this.abort.signal.aborted && !FINAL.has(live.state)) {
      try {
        for await (const message of messages(live.run, live.seq, this.abort.signal)) {
          this.connection = ["live", "live"];
          wait = 500;
          if (live.take(message)) this.later();
          if (FINAL.has(live.state)) break;
        }
      } catch (error) {
        if (this.abort.signal.aborted) return;
        if (error instanceof Problem && error.status < 500 && error.status !== 429) return this.fail(error);
      }
      if (FINAL.has(live.state)) break;
      this.connection = ["waiting", "reconnecting"];
      this.later();
      await pause(wait);
      wait = Math.min(2 * wait, 8000);
      await this.readInfo();
      if (FINAL.has(this.info.state) && !this.caughtUp) this.caughtUp = true; // One more look at the stream.
      else if (FINAL.has(this.info.state)) Object.assign(live, { state: this.info.state, cause: this.info.cause, message: this.info.message });
    }
    this.connection = ["", "ended"];
    await this.readOutcome();
    this.later();
  }

  async readInfo() {
    try {
      this.info = await call(`v1/runs/${encodeURIComponent(this.live.run)}`, { signal: this.abort.signal });
      this.later();
    } catch (error) {
      if (error instanceof Problem && error.status < 500) this.fail(error);
    }
  }

  async readOutcome() {
    try {
      this.outcome = await call(`v1/runs/${encodeURIComponent(this.live.run)}/files/outcome.json`, { signal: this.abort.signal });
    } catch {
      this.outcome = null; // A run that was cancelled in the queue has none.
    }
  }

  async cancel(button) {
    if (!confirm("Cancel this run?")) return;
    button.disabled = true;
    try {
      await call(`v1/runs/${encodeURIComponent(this.live.run)}:cancel`, { method: "POST" });
      this.cancelling = true;
    } catch (error) {
      this.notice = error.message;
    }
    this.later();
  }

  fail(error) {
    this.abort.abort();
    clearInterval(this.timer);
    this.element.replaceChildren(h("p.problem", {}, error.message), h("p", {}, h("a", { href: "#/" }, "All runs")));
  }

  // Drawing ------------------------------------------------------------------------------------------------------

  later() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.draw();
    });
  }

  draw() {
    const { live } = this;
    this.drawHead();
    this.drawRanks();
    this.drawChecks();
    this.drawLog();
    const energy = live.progress?.energy;
    if (energy) {
      const shown = TERMS.filter(([name]) => energy[name] !== 0);
      this.ledgerLegend.replaceChildren(legend(shown.map(([name, colour]) => [name, colour, si(energy[name], "J")])));
      this.residualNote.replaceChildren(residual(energy.residual));
    }
    this.imbalanceNote.textContent = live.load ? live.load.imbalance.toFixed(2) : "";
    for (const chart of this.charts) chart.draw();
    document.title = `${percent(live.fraction)} ${this.info.name ?? live.run} · Conoid`;
  }

  drawHead() {
    const { live, info } = this;
    const state = this.cancelling && !FINAL.has(live.state) ? "stopping" : live.state;
    const waits = live.state === "queued" ? info.reason : "";
    const told = [live.cause, live.message, waits, this.notice].filter((text) => text && text !== live.state).join(" · ");
    const stop = FINAL.has(state) ? null
      : this.stop ??= h("button.stop", { type: "button", onclick: () => this.cancel(this.stop) }, "Cancel");
    this.head.replaceChildren(
      h("div.run-head", {},
        h("div.titles", {}, h("h1", {}, info.title || info.name || live.run), h("div.sub", {}, live.run)),
        h("div.side", {}, h(`span.link.${this.connection[0] || "over"}`, {}, this.connection[1]), pill(state), stop)),
      h("div.progress", {}, meter(state, live.fraction), h("b", {}, percent(live.fraction))),
      told ? h("p.told", {}, told) : "",
      this.facts());
  }

  facts() {
    const { live } = this;
    const { progress, counts, started, load } = live;
    const entry = (name, value, note, broad) =>
      h(broad ? "div.broad" : "div", {}, h("dt", {}, name), h("dd", {}, value, note ? h("small", {}, ` ${note}`) : null));
    return h("dl.facts", {},
      entry("time", progress ? si(live.fraction * progress.end_time, "s") : "–", progress ? `of ${si(progress.end_time, "s")}` : ""),
      entry("time left", FINAL.has(live.state) ? "–" : duration(progress?.eta)),
      entry("elapsed", duration(live.elapsed)),
      entry("step", count(progress?.step)),
      entry("dt", si(progress?.dt, "s")),
      entry("dt held by", progress?.limiter ?? "–", "", true),
      entry("imbalance", load ? load.imbalance.toFixed(2) : "–"),
      entry("residual", progress ? residual(progress.energy.residual) : "–"),
      entry("updates a second", si(progress?.updates_per_second)),
      entry("elements", count(counts?.elements ?? started?.elements)),
      entry("nodes", count(counts?.nodes ?? started?.nodes)),
      entry("shared nodes", count(counts?.shared)),
      entry("fragments", count(counts?.fragments)),
      counts?.particles ? entry("particles", count(counts.particles)) : "");
  }

  drawRanks() {
    const { load } = this.live;
    const { groups = {}, totals = [], busy = [] } = load ?? {};
    const longest = Math.max(...totals, 1e-300);
    const rows = totals.slice(0, MOST_RANKS).flatMap((_, rank) => {
      const pieces = Object.entries(groups).map(([name, seconds]) =>
        h("i", { title: `${name} ${si(seconds[rank], "s")}`, style: { width: `${(100 * seconds[rank]) / longest}%`, background: `var(--${name})` } }));
      return [h("span.who", {}, `rank ${rank}`), h("div.stack", {}, pieces), h("span.busy", {}, `${Math.round(100 * busy[rank])} % busy`)];
    });
    const more = totals.length - MOST_RANKS;
    this.ranks.replaceChildren(
      h("div.card-head", {}, h("h2", {}, "Load of each rank"), more > 0 ? h("span.note", {}, `${totals.length} ranks, the first ${MOST_RANKS} shown`) : ""),
      totals.length ? h("div.ranks", {}, rows) : h("p.hint", {}, "waiting for the first numbers"),
      totals.length ? legend(Object.keys(groups).map((name) => [name, name])) : "");
  }

  drawChecks() {
    const checks = this.outcome?.reference ?? [];
    if (!checks.length || this.checks.childElementCount) return;
    this.checks.hidden = false;
    const exact = (value, unit) => `${Number(value.toPrecision(5))} ${unit ?? ""}`.trim();
    this.checks.append(h("div.card-head", {}, h("h2", {}, "Against the reference")), h("div.scroll", {}, h("table.checks", {},
      h("thead", {}, h("tr", {}, ["quantity", "computed", "expected", "tolerance", "", "source"].map((name) => h("th", {}, name)))),
      h("tbody", {}, checks.map((check) => h("tr", {},
        h("td", {}, check.name),
        ...[exact(check.value, check.unit), exact(check.expected, check.unit), `± ${exact(check.tolerance, check.unit)}`].map((text) => h("td.number", {}, text)),
        h(`td.${check.pass ? "good" : "bad"}`, {}, check.pass ? "agrees" : "differs"),
        h("td.hint", {}, check.source ?? "")))))));
  }

  drawLog() {
    const { log } = this.live;
    const last = log.at(-1)?.seq ?? 0;
    if (this.logged === last) return;
    this.logged = last;
    const atEnd = this.log.scrollTop + this.log.clientHeight >= this.log.scrollHeight - 8;
    if (!log.length) return this.log.replaceChildren(h("span.hint", {}, "nothing yet"));
    this.log.replaceChildren(...log.map((entry) =>
      h(`div.${entry.level}`, {}, h("time", {}, clock(entry.wall)), `  [${entry.rank ?? 0}] ${entry.text}`)));
    if (atEnd) this.log.scrollTop = this.log.scrollHeight;
  }

  tell(points, t, words) {
    return points.length > 1 && t <= points.at(-1).t ? [si(t, "s"), ...words(at(points, t))] : null;
  }

  tellEnergy(t) {
    return this.tell(this.live.ledger, t, ({ energy }) =>
      TERMS.filter(([name]) => energy[name] !== 0).map(([name]) => `${name} ${si(energy[name], "J")}`));
  }
}

function residual(value) {
  const tone = value < 1e-3 ? "good" : value < 1e-2 ? "warn" : "bad";
  return h(`span.${tone}`, {}, value.toExponential(1));
}
