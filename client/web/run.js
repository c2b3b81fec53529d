// Page of one run, drawn from the run's history and messages.

import { call, download, messages, refused } from "./api.js";
import { Body } from "./body.js";
import { Cards } from "./cards.js";
import { fixed, h, percent, words } from "./figures.js";
import { Files } from "./files.js";
import { Headline } from "./headline.js";
import { fill, followColumns } from "./history.js";
import { FINAL, Live } from "./live.js";
import { Logs, Warnings } from "./logs.js";
import { Numbers, ended, residual } from "./numbers.js";
import { Balances, Ranks, checksTable } from "./panels.js";
import { nothing, plots } from "./plots.js";
import { RunState } from "./runstate.js";

const FIRST = 3000; // Time in ms: the charts are drawn after the 3-D view, or at the latest after this time.
// Time in ms between two drawings of the charts; the head and the bars are drawn with every message.
const CHARTS_EVERY = 500;
const QUEUE_EVERY = 3; // Time in s after which the position in the queue is requested again.
const STAGES = { "": "No data of this run has been read yet.", accepted: "The server accepts this run.", queued: "This run waits in the queue.", starting: "This run starts: the mesh is made and the solver is loaded." };
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

export class RunPage {
  // `onRefused` is called when the token is no longer valid.
  constructor(run, onRefused) {
    Object.assign(this, { live: new Live(run), info: {}, outcome: null, abort: new AbortController(), connection: ["waiting", "connecting"], due: false, plotted: 0, busy: new Set(), onRefused });
    this.path = `v1/runs/${encodeURIComponent(run)}`;
    this.build();
    this.timer = setInterval(() => this.tick(), 1000);
    this.follow();
  }

  close() {
    this.abort.abort();
    clearInterval(this.timer);
    this.body.close();
    for (const [, [chart]] of this.drawn) chart.close();
  }

  build() {
    const { live } = this;
    this.head = new Headline(live.run, (verb) => this.ask(verb));
    this.numbers = new Numbers();
    this.notes = { residual: h("span.note"), imbalance: h("span.note") };
    this.logs = new Logs(live);
    this.warnings = new Warnings();
    this.files = new Files(live.run);
    this.situation = new RunState(live.run, () => this.files.read());
    this.body = new Body(live.run, (snapshot) => {
      this.charts.snapshot = snapshot;
      this.charts.sizes[0].draw(true);
    });
    this.charts = plots(live, (place) => this.balances.open(place), Promise.race([this.body.drawn, pause(FIRST)]));
    this.empty = h("section.card.empty-stage", { "aria-label": "the body" });
    this.fillCards();
    this.element = h("div.work", {}, this.head.element, this.situation.element,
      h("div.bench", {}, h("div.stage", {}, this.body.element, this.empty),
        h("aside.now", { "aria-label": "now" }, this.body.card.element, this.numbers.element, this.warnings.element, this.cards.beside, this.files.element, this.logs.element)),
      this.cards.grid, this.cards.shelf);
    this.draw();
  }

  // Adds the cards in their order: reference numbers, charts with data, ranks, balance events.
  fillCards() {
    this.cards = new Cards("energy");
    this.checks = h("div");
    this.ranks = new Ranks();
    this.balances = new Balances(this.live, () => this.cards.open("balances"));
    const add = (name, title, beside, content) => this.cards.add(name, title, beside, content);
    add("checks", "Against the reference", "", this.checks);
    for (const [name, [chart, title, beside]] of this.drawn) add(name, title, h("span.beside", {}, beside, this.notes[name]), chart.element);
    add("ranks", "Time of each rank by activity", this.ranks.note, this.ranks.element);
    add("balances", this.balances.title, this.balances.beside, this.balances.element).setAttribute("aria-label", "balance events");
    this.cards.show("checks", false);
    this.cards.show("balances", false);
    this.cards.place();
  }

  // Returns [name, [chart, …]] for all charts.
  get drawn() { return Object.entries(this.charts).filter(([, made]) => Array.isArray(made)); }

  // Messages -----------------------------------------------------------------------------------------------------

  async follow() {
    const { live } = this;
    let wait = 500;
    this.readBody();
    await this.readInfo();
    let filled = false;
    while (!this.abort.signal.aborted) {
      let [away, lost] = [false, null];
      try {
        if (!filled) {
          await fill(live, this.info, this.abort.signal);
          followColumns(live, this.abort.signal, () => this.drawCharts());
        }
        filled = true;
        this.later();
        if (FINAL.has(live.state)) break;
        for await (const message of messages(live.run, live.seq, this.abort.signal, () => this.hears())) {
          wait = 500;
          if (live.take(message)) this.later(message);
          if (FINAL.has(live.state)) break;
        }
      } catch (error) {
        if (this.abort.signal.aborted) return;
        if (refused(error)) return this.fail(error);
        [away, lost] = [true, error];
      }
      if (FINAL.has(live.state)) break;
      this.connection = ["waiting", away ? `${lost.message}, next request in ${Math.ceil(wait / 1000)} s` : "reconnecting"];
      this.later();
      await pause(wait);
      wait = Math.min(2 * wait, 8000);
      await this.readInfo();
      if (FINAL.has(this.info.state) && this.caughtUp) Object.assign(live, { state: this.info.state, cause: this.info.cause, message: this.info.message });
      this.caughtUp = FINAL.has(this.info.state); // The stream is read once more before the run counts as ended.
    }
    this.connection = ["", "ended"];
    await this.readInfo();
    this.readOutcome();
    this.later();
  }

  // The 3-D view is drawn before the history has been read.
  async readBody() {
    const { snapshots } = await call(`${this.path}/snapshots`, { signal: this.abort.signal }).catch(() => ({ snapshots: [] }));
    if (!snapshots.length) this.body.ready();
    if (this.abort.signal.aborted) return;
    if (this.live.snapshots.length < snapshots.length) this.live.snapshots = snapshots;
    // Called without waiting for a frame, because the first frames of a new tab are late.
    this.body.update(this.live.snapshots);
    this.later();
  }

  hears() {
    this.connection = ["live", "live"];
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
  readOutcome() {
    this.outcome = this.info.outcome ?? null;
    for (const text of this.outcome?.warnings ?? []) this.live.warn("warning", text);
  }

  // No message reports the position in the queue, so it is requested regularly.
  tick() {
    this.later();
    this.ticks = (this.ticks ?? 0) + 1;
    if (this.live.state === "queued" && this.ticks % QUEUE_EVERY === 0) this.readInfo();
  }

  // Saves the report of the run; the server makes the report if it does not exist yet.
  async saveReport() {
    this.busy.add("report");
    this.notice = "The server makes the report; this may take a minute.";
    this.later();
    try {
      const { url, size } = await call(`${this.path}:report`, { method: "POST" });
      await download(url.replace(/^\//, ""), `${this.info.name || "run"}-${this.live.run.slice(0, 9)}.html`, size, () => {});
      this.notice = "The report is saved.";
      if (this.files.known) this.files.read();
    } catch (error) {
      this.notice = `No report: ${error.message}`;
    }
    this.busy.delete("report");
    this.later();
  }

  async ask(verb) {
    if (verb === "report") return this.saveReport();
    if (verb === "cancel" && !confirm("Cancel this run?")) return;
    this.busy.add(verb);
    this.later();
    try {
      await call(`${this.path}:${verb}`, { method: "POST" });
      this.cancelling ||= verb === "cancel";
      this.notice = verb === "cancel" ? "" : `${verb} asked for`;
    } catch (error) {
      this.notice = error.message;
    }
    if (!this.cancelling) this.busy.delete(verb);
    return this.later();
  }

  // Shows that the run does not exist, or that only the record of its removal exists.
  fail(error) {
    this.close();
    if (error.status === 401 && this.onRefused) return this.onRefused();
    const ended = error.body?.outcome;
    const kept = ended && `It ended as ${words(ended.state ?? "unknown")}${ended.cause ? ` (${ended.cause})` : ""}.`;
    this.element.replaceChildren(h("section.card.missing", {}, h("h1", {}, error.status === 410 ? "This run was removed" : error.status === 404 ? "There is no such run" : "This run cannot be shown"),
      h("p.problem", {}, error.message), kept ? h("p", {}, kept) : "", h("p", {}, h("a.button", { href: "#/" }, "All runs"))));
    return undefined;
  }

  // Drawing ------------------------------------------------------------------------------------------------------

  // Measures the time from a message to its pixels as "conoid:event" in the browser's timeline.
  later(message) {
    if (message) this.born ??= message.wall;
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      if (this.abort.signal.aborted) return; // Another page is shown now.
      this.draw();
      const start = 1000 * this.born - performance.timeOrigin;
      this.born = undefined;
      if (!(start > 0)) return; // The message is older than the page.
      performance.measure("conoid:event", { start, end: performance.now() });
      performance.clearMeasures("conoid:event");
    });
  }

  draw() {
    const { live } = this;
    this.drawHead();
    this.numbers.draw(live, this.info, this.outcome);
    this.ranks.draw(live);
    this.balances.draw();
    this.cards.show("balances", live.balances.length > 0);
    for (const [name, missing] of Object.entries(nothing(live))) this.cards.show(name, !missing);
    this.logs.draw(this.info.ranks ?? 0);
    this.warnings.draw(live);
    this.situation.draw(live, this.outcome);
    this.body.update(live.snapshots);
    this.drawStage();
    this.drawChecks();
    this.drawNotes();
    if (performance.now() - this.plotted > CHARTS_EVERY && live.seq !== this.charted) {
      [this.plotted, this.charted] = [performance.now(), live.seq];
      setTimeout(() => this.drawCharts());
    }
    document.title = `${live.state ? `${percent(live.fraction)} ` : ""}${this.info.name ?? live.run} · Conoid`;
  }

  // Draws the charts after the frame that draws the head and the bars.
  drawCharts() {
    if (!this.abort.signal.aborted) for (const [, [chart]] of this.drawn) chart.draw(FINAL.has(this.live.state));
  }

  drawNotes() {
    const { progress, load } = this.live;
    if (progress) this.notes.residual.replaceChildren(residual(...ended(progress, this.outcome).residual));
    this.notes.imbalance.textContent = load ? fixed(load.imbalance) : "";
  }

  drawHead() {
    const { live, connection, notice, busy } = this;
    const state = this.cancelling && !FINAL.has(live.state) ? "stopping" : live.state || (this.info.state ?? "");
    this.head.draw(live, this.info, { connection, state, notice, busy });
  }

  drawChecks() {
    const checks = this.outcome?.reference ?? [];
    if (!checks.length || this.checks.childElementCount) return;
    this.checks.append(checksTable(checks));
    this.cards.show("checks", true);
  }

  // Before the first snapshot, the place of the 3-D view shows why no snapshot exists.
  drawStage() {
    const { state, message, snapshots } = this.live;
    this.empty.hidden = snapshots.length > 0;
    if (this.empty.hidden) return;
    this.empty.className = `card empty-stage${FINAL.has(state) ? " brief" : ""}`;
    const text = FINAL.has(state) ? "This run has no snapshot." : STAGES[state] ?? "The first snapshot will be shown here.";
    const more = state === "queued" ? this.info.reason : message;
    this.empty.replaceChildren(h("div", {}, h("p", {}, text), FINAL.has(state) ? "" : h("p.hint", {}, more)));
  }
}
