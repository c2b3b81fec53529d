// The page of one run: everything on it follows from the run's history and messages.

import { call, messages, refused } from "./api.js";
import { Body } from "./body.js";
import { alike, count, counted, duration, fixed, h, large, meter, percent, pill, rough, si } from "./figures.js";
import { fill, readPlan } from "./history.js";
import { FINAL, Live } from "./live.js";
import { Balances, Logs, Ranks, checksTable } from "./panels.js";
import { card, plots } from "./plots.js";

const CHARTS_EVERY = 500; // ms; the head and the bars are drawn with every message.
const OLD = 5; // s without a message or the server after which the age of the numbers is shown.
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export class RunPage {
  constructor(run) {
    Object.assign(this, { live: new Live(run), info: {}, outcome: null, abort: new AbortController(), connection: ["waiting", "connecting"], due: false, plotted: 0 });
    this.path = `v1/runs/${encodeURIComponent(run)}`;
    this.build();
    this.timer = setInterval(() => this.later(), 1000);
    this.follow();
  }

  close() {
    this.abort.abort();
    clearInterval(this.timer);
    this.body.close();
    for (const [chart] of Object.values(this.charts).filter(Array.isArray)) chart.close();
  }

  build() {
    const { live } = this;
    this.head = h("div.card");
    this.checks = h("div.card.wide", { hidden: "" });
    this.notes = { energy: h("span.note"), residual: h("span.note"), imbalance: h("span.note"), counts: h("span.note") };
    this.ranks = new Ranks();
    this.balances = new Balances(live);
    this.logs = new Logs(live);
    this.charts = plots(live, (place) => this.balances.open(place));
    this.body = new Body(live.run, (snapshot) => {
      this.charts.snapshot = snapshot;
      this.charts.sizes[0].draw(true);
    });
    const plot = (name) => {
      const [chart, title, beside] = this.charts[name];
      return card(title, h("span.beside", {}, beside, this.notes[name]), chart.element);
    };
    this.buttons = ["checkpoint", "snapshot", "cancel"].map((verb) =>
      h(verb === "cancel" ? "button.stop" : "button.quiet", { type: "button", onclick: ({ currentTarget }) => this.ask(verb, currentTarget) }, verb[0].toUpperCase() + verb.slice(1)));
    this.element = h("div", {}, this.head, h("div.cards", {}, this.body.element, this.checks,
      this.ranks.element, plot("imbalance"), this.balances.element, plot("counts"), plot("sizes"), plot("energy"), plot("residual"),
      plot("heat"), plot("dt"), plot("contact"), this.logs.element));
    this.draw();
  }

  // Messages -----------------------------------------------------------------------------------------------------

  async follow() {
    const { live } = this;
    let wait = 500;
    await this.readInfo();
    let filled = false;
    while (!this.abort.signal.aborted) {
      try {
        if (!filled) await fill(live, this.info, await readPlan(live.run, this.abort.signal), this.abort.signal);
        filled = true;
        this.later();
        if (FINAL.has(live.state)) break;
        for await (const message of messages(live.run, live.seq, this.abort.signal)) {
          this.connection = ["live", "live"];
          wait = 500;
          if (live.take(message)) this.later(message);
          if (FINAL.has(live.state)) break;
        }
      } catch (error) {
        if (this.abort.signal.aborted) return;
        if (refused(error)) return this.fail(error);
      }
      if (FINAL.has(live.state)) break;
      this.connection = ["waiting", "reconnecting"];
      this.later();
      await pause(wait);
      wait = Math.min(2 * wait, 8000);
      await this.readInfo();
      if (FINAL.has(this.info.state) && this.caughtUp) Object.assign(live, { state: this.info.state, cause: this.info.cause, message: this.info.message });
      this.caughtUp = FINAL.has(this.info.state); // One more look at the stream before the end is believed.
    }
    this.connection = ["", "ended"];
    await this.readInfo();
    await this.readOutcome();
    this.later();
  }

  async readInfo() {
    try {
      this.info = await call(this.path, { signal: this.abort.signal });
      this.later();
    } catch (error) {
      if (refused(error)) this.fail(error);
    }
  }

  // A run that was cancelled in the queue has no outcome.
  async readOutcome() {
    this.outcome = this.info.outcome ?? null;
  }

  async ask(verb, button) {
    if (verb === "cancel" && !confirm("Cancel this run?")) return;
    button.disabled = true;
    try {
      await call(`${this.path}:${verb}`, { method: "POST" });
      this.cancelling ||= verb === "cancel";
      this.notice = verb === "cancel" ? "" : `${verb} asked for`;
    } catch (error) {
      this.notice = error.message;
    }
    button.disabled = this.cancelling;
    this.later();
  }

  fail(error) {
    this.close();
    this.element.replaceChildren(h("p.problem", {}, error.message), h("p", {}, h("a", { href: "#/" }, "All runs")));
  }

  // Drawing ------------------------------------------------------------------------------------------------------

  // The time from a message's birth to the pixels stands in the browser's timeline as "conoid:event".
  later(message) {
    if (message) this.born ??= message.wall;
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      if (this.abort.signal.aborted) return; // Another page is shown.
      this.draw();
      const start = 1000 * this.born - performance.timeOrigin;
      this.born = undefined;
      if (!(start > 0)) return; // Older than the page.
      performance.measure("conoid:event", { start, end: performance.now() });
      performance.clearMeasures("conoid:event");
    });
  }

  draw() {
    const { live } = this;
    this.drawHead();
    this.ranks.draw(live);
    this.balances.draw();
    this.logs.draw(this.info.ranks ?? 0);
    this.body.update(live.snapshots);
    this.drawChecks();
    this.drawNotes();
    if (performance.now() - this.plotted > CHARTS_EVERY && live.seq !== this.charted) {
      [this.plotted, this.charted] = [performance.now(), live.seq];
      setTimeout(() => this.drawCharts());
    }
    document.title = `${percent(live.fraction)} ${this.info.name ?? live.run} · Conoid`;
  }

  // After the frame that has the news in the head and the bars.
  drawCharts() {
    if (!this.abort.signal.aborted) for (const [chart] of Object.values(this.charts).filter(Array.isArray)) chart.draw(FINAL.has(this.live.state));
  }

  drawNotes() {
    const { progress, load, counts } = this.live;
    if (progress) {
      this.notes.residual.replaceChildren(residual(progress.energy.residual));
      this.notes.energy.textContent = `kinetic ${si(progress.energy.kinetic, "J")}`;
    }
    this.notes.imbalance.textContent = load ? fixed(load.imbalance) : "";
    this.notes.counts.textContent = counts ? counted(counts.fragments, "fragment") : "";
  }

  drawHead() {
    const { live, info } = this;
    const state = this.cancelling && !FINAL.has(live.state) ? "stopping" : live.state;
    const waits = live.state === "queued" ? info.reason : "";
    const told = [live.cause, live.message, waits, this.notice].filter((text) => text && text !== live.state).join(" · ");
    const old = !FINAL.has(live.state) && live.age > OLD ? `numbers ${duration(live.age)} old` : "";
    const [checkpoint, snapshot, cancel] = this.buttons;
    const shown = FINAL.has(state) ? [] : state === "running" ? [checkpoint, snapshot, cancel] : [cancel];
    this.head.replaceChildren(
      h("div.run-head", {},
        h("div.titles", {}, h("h1", {}, info.title || info.name || live.run), h("div.sub", {}, live.run)),
        h("div.side", {}, h(`span.link.${this.connection[0] || "over"}`, { role: "status" }, [this.connection[1], old].filter(Boolean).join(", ")), pill(state), shown)),
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
      entry("time", ...(progress ? timed(live.fraction * progress.end_time, progress.end_time) : ["–"])),
      entry("time left", FINAL.has(live.state) ? "–" : duration(progress?.eta)),
      entry("elapsed", duration(live.elapsed)),
      entry("step", count(progress?.step)),
      entry("dt", si(progress?.dt || live.ledger.findLast(({ dt }) => dt > 0)?.dt, "s")),
      entry("dt held by", progress?.limiter || "–", "", true),
      entry("imbalance", load ? fixed(load.imbalance) : "–"),
      entry("residual", progress ? residual(progress.energy.residual) : "–"),
      entry("updates a second", large(progress?.updates_per_second)),
      entry("elements", count(counts?.elements ?? started?.elements)),
      entry("nodes", count(counts?.nodes ?? started?.nodes)),
      entry("shared nodes", count(counts?.shared)),
      entry("fragments", count(counts?.fragments)),
      counts?.particles ? entry("particles", count(counts.particles)) : "");
  }

  drawChecks() {
    const checks = this.outcome?.reference ?? [];
    if (!checks.length || this.checks.childElementCount) return;
    this.checks.hidden = false;
    this.checks.append(...checksTable(checks));
  }
}

// The time so far and "of …" the end, in one unit.
function timed(now, end) {
  const [first, last] = alike([now, end], "s");
  return [first, `of ${last}`];
}

function residual(value) {
  const tone = value < 1e-3 ? "good" : value < 1e-2 ? "warn" : "bad";
  return h(`span.${tone}`, {}, rough(value));
}
