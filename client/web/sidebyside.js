// Bodies of several runs side by side: one camera, one clock, the nearest snapshot of each run.

import { binary } from "./api.js";
import { share } from "./camera.js";
import { counted, h, si } from "./figures.js";
import { three } from "./libraries.js";
import { swatch } from "./linestyles.js";
import { range } from "./ranges.js";
import { scaleOf } from "./scales.js";
import { colourings, decode } from "./snapshot.js";
import { View3d } from "./view3d.js";

const MOST = 4;
const AT_FIRST = 2;
const PLAY = 400; // ms for each step of the clock.
const STEPS = 100; // Steps of the clock.
const MOST_KEPT = 24; // Largest number of decoded snapshots for each run.

// The snapshot nearest to a time.
export const nearestTo = (entries, t) => entries.reduce((best, one) => (Math.abs(one.t - t) < Math.abs(best.t - t) ? one : best));

export class SideBySide {
  constructor() {
    Object.assign(this, { runs: [], chosen: null, panes: new Map(), time: 1 });
    this.row = h("div.panes");
    this.clock = h("input", { type: "range", min: 0, max: STEPS, step: 1, value: STEPS, "aria-label": "simulated time", oninput: () => this.tick() });
    this.told = h("span.note");
    this.by = h("select", { "aria-label": "colour by", onchange: () => this.paint() }, ["fragment", "part", "rank"].map((name) => h("option", { value: name }, name)));
    this.playing = h("button.quiet", { type: "button", onclick: () => (this.player ? this.pause() : this.play()) }, "Play");
    this.choice = h("div.picks", { role: "group", "aria-label": "bodies that are shown, up to four" });
    this.element = h("section.card", { hidden: "", "aria-label": "bodies side by side" },
      h("div.card-head", {}, h("h2", {}, "Bodies side by side"), this.told, h("span.beside", {}, h("label.field", {}, "Colour ", this.by))), this.choice, this.row, h("div.scrub", {}, this.playing, this.clock));
  }

  // Runs with snapshots, { id, snapshots, line, called }; the first two are shown.
  offer(runs) {
    this.runs = runs;
    this.element.hidden = !runs.length;
    this.chosen ??= runs.slice(0, AT_FIRST).map(({ id }) => id);
    this.end = Math.max(0, ...runs.map(({ snapshots }) => snapshots.at(-1).t));
    this.drawChoice();
    this.watch ??= this.whenSeen();
    if (this.seen) this.place();
  }

  // The body is drawn when it comes near the window.
  whenSeen() {
    const eye = new IntersectionObserver((entries) => {
      if (!entries.at(-1).isIntersecting) return;
      this.seen = true;
      eye.disconnect();
      this.place();
    }, { rootMargin: "200px" });
    eye.observe(this.element);
    return eye;
  }

  drawChoice() {
    this.choice.replaceChildren(...this.runs.map(({ id, line, called }) => {
      const on = this.chosen.includes(id);
      return h("label.pick", {}, h("input", { type: "checkbox", value: id, checked: on ? "" : false, disabled: !on && this.chosen.length >= MOST ? "" : false, onchange: () => this.choose(id) }), swatch(line), called);
    }));
  }

  choose(id) {
    this.chosen = this.chosen.includes(id) ? this.chosen.filter((one) => one !== id) : [...this.chosen, id];
    this.drawChoice();
    this.choice.querySelector(`[value="${CSS.escape(id)}"]`)?.focus();
    this.place();
  }

  // A pane for each selected run.
  async place() {
    const modules = await three().catch(() => null);
    if (!modules) return this.row.replaceChildren(h("p.hint", {}, "No 3-D: the server has no libraries for it"));
    if (this.closed) return;
    for (const [id, pane] of this.panes) if (!this.chosen.includes(id)) this.drop(id, pane);
    for (const id of this.chosen) if (!this.panes.has(id)) this.panes.set(id, this.pane(this.runs.find((run) => run.id === id), modules));
    this.row.replaceChildren(...this.chosen.map((id) => this.panes.get(id).element));
    await this.tick();
    const views = this.chosen.map((id) => this.panes.get(id)?.view).filter(Boolean);
    views.forEach((view, i) => view.set({ legend: i === 0 }));
    share(views);
  }

  drop(id, { view }) {
    view.close();
    this.panes.delete(id);
  }

  pane(run, modules) {
    const view = new View3d(modules);
    view.canvas.tabIndex = 0;
    view.canvas.setAttribute("role", "application");
    view.canvas.setAttribute("aria-label", `the body of ${run.called}; arrow keys turn all bodies, plus and minus zoom`);
    const caption = h("figcaption", {});
    return { run, view, kept: new Map(), caption, element: h("figure.pane", {}, h("div.who", {}, swatch(run.line), run.called), view.element, caption) };
  }

  get t() { return (Number(this.clock.value) / STEPS) * this.end; }

  async tick() {
    const { t } = this;
    this.told.textContent = si(t, "s");
    this.clock.setAttribute("aria-valuetext", si(t, "s"));
    await Promise.all([...this.panes.values()].map((pane) => this.show(pane, t)));
    this.offerColours();
  }

  // Only the last request is fetched when the clock is faster than the network.
  async show(pane, t) {
    pane.wanted = t;
    if (pane.busy) return;
    pane.busy = true;
    try {
      while (pane.wanted !== null) {
        const entry = nearestTo(pane.run.snapshots, pane.wanted);
        pane.wanted = null;
        if (pane.shown === entry.n) continue;
        const snapshot = await this.read(pane, entry);
        if (this.closed || !this.panes.has(pane.run.id)) return;
        Object.assign(pane, { shown: entry.n, snapshot });
        pane.view.show(snapshot);
        this.paintOne(pane);
        pane.caption.textContent = `${si(entry.t, "s")} · ${counted(entry.fragments, "fragment")}`;
      }
    } catch (error) {
      pane.caption.textContent = error.message;
    } finally {
      pane.busy = false;
    }
  }

  async read({ run, kept }, { n }) {
    const found = kept.get(n) ?? decode(await binary(`v1/runs/${encodeURIComponent(run.id)}/snapshots/${n}`));
    kept.set(n, found);
    if (kept.size > MOST_KEPT) kept.delete(kept.keys().next().value);
    return found;
  }

  offerColours() {
    const lists = [...this.panes.values()].filter(({ snapshot }) => snapshot).map(({ snapshot }) => colourings(snapshot));
    const names = (lists[0] ?? []).filter((name) => lists.every((list) => list.includes(name)));
    if (!names.length || names.join() === [...this.by.options].map(({ value }) => value).join()) return;
    const before = this.by.value;
    this.by.replaceChildren(...names.map((name) => h("option", { value: name }, ["fragment", "part", "rank"].includes(name) ? name : scaleOf(name).label)));
    this.by.value = names.includes(before) ? before : names[0];
  }

  // One colour scale for all shown bodies and all times.
  paintOne({ view, snapshot }) {
    const by = this.by.value;
    if (!snapshot.header.fields[by]) return view.colour(by);
    const told = this.chosen.flatMap((id) => this.panes.get(id)?.run.snapshots ?? []).map(({ fields }) => fields?.[by]).filter(Boolean);
    return view.colour(by, range({ how: "most", over: "run" }, by, snapshot, told));
  }

  paint() {
    for (const pane of this.panes.values()) if (pane.snapshot) this.paintOne(pane);
  }

  play() {
    if (Number(this.clock.value) >= STEPS) this.clock.value = 0;
    this.playing.textContent = "Pause";
    this.player = setInterval(() => {
      this.clock.value = Number(this.clock.value) + 2;
      this.tick();
      if (Number(this.clock.value) >= STEPS) this.pause();
    }, PLAY);
  }

  pause() {
    clearInterval(this.player);
    this.player = null;
    this.playing.textContent = "Play";
  }

  close() {
    this.closed = true;
    clearInterval(this.player);
    this.watch?.disconnect();
    for (const { view } of this.panes.values()) view.close();
  }
}
