// 3-D views of several runs side by side: one camera, one time, one section and one colour scale for all views.

import { share } from "./camera.js";
import { h, si } from "./figures.js";
import { act } from "./keys.js";
import { three } from "./libraries.js";
import { swatch } from "./linestyles.js";
import { Pane } from "./pane.js";
import { SectionPlane } from "./plane.js";
import { range } from "./ranges.js";
import { colourings } from "./snapshot.js";
import { Tools } from "./tools.js";

const MOST = 4;
const AT_FIRST = matchMedia("(min-width: 1100px)").matches ? 3 : 2;
const PLAY = 400; // Time in ms for each step of the common time.
const STEPS = 100; // Number of steps of the common time from the start to the end.

export class SideBySide {
  constructor() {
    Object.assign(this, { runs: [], chosen: null, panes: new Map(), time: 1 });
    this.row = h("div.panes");
    this.clock = h("input", { type: "range", min: 0, max: STEPS, step: 1, value: STEPS, "aria-label": "simulated time", oninput: () => this.tick() });
    this.clockText = h("span.note");
    this.tools = new Tools({
      colour: () => this.paint(), section: () => this.choose(), slice: () => this.slice(), camera: (name) => this.look(name),
      follow: (text) => this.follow(text), set: (name, value) => this.set(name, value), opacities: () => this.fade(),
    }, ["Fragments", "Save"]);
    this.plane = new SectionPlane(this.tools);
    this.playing = h("button.quiet", { type: "button", onclick: () => (this.player ? this.pause() : this.play()) }, "Play");
    this.choice = h("div.picks", { role: "group", "aria-label": "bodies that are shown, up to four" });
    this.element = h("section.card", { hidden: "", "aria-label": "bodies side by side" },
      h("div.card-head", {}, h("h2", {}, "Bodies side by side"), this.clockText), this.choice, this.tools.element, this.tools.cutting, this.row, h("div.scrub", {}, this.playing, this.clock));
    this.row.addEventListener("keydown", (event) => this.key(event));
  }

  // Takes the runs with snapshots, { id, snapshots, line, called, plan }; the first two or three runs are shown.
  offer(runs) {
    this.runs = runs;
    this.element.hidden = !runs.length;
    this.chosen ??= runs.slice(0, AT_FIRST).map(({ id }) => id);
    this.end = Math.max(0, ...runs.map(({ snapshots }) => snapshots.at(-1).t));
    this.drawChoice();
    this.watch ??= this.whenSeen();
    if (this.seen) this.place();
  }

  // The 3-D views are drawn when they come near the window.
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
      return h("label.pick", {}, h("input", { type: "checkbox", value: id, checked: on ? "" : false, disabled: !on && this.chosen.length >= MOST ? "" : false, onchange: () => this.toggle(id) }), swatch(line), called);
    }));
  }

  toggle(id) {
    this.chosen = this.chosen.includes(id) ? this.chosen.filter((one) => one !== id) : [...this.chosen, id];
    this.drawChoice();
    this.choice.querySelector(`[value="${CSS.escape(id)}"]`)?.focus();
    this.place();
  }

  // Makes a view for each selected run.
  async place() {
    const modules = await three().catch(() => null);
    if (!modules) return this.row.replaceChildren(h("p.hint", {}, "No 3-D: the server has no libraries for it"));
    if (this.closed) return;
    for (const [id, pane] of this.panes) if (!this.chosen.includes(id)) this.drop(id, pane);
    for (const id of this.chosen) if (!this.panes.has(id)) this.panes.set(id, this.pane(this.runs.find((run) => run.id === id), modules));
    this.row.replaceChildren(...this.shown.map(({ element }) => element));
    this.tools.mirrorLine.hidden = !this.shown.some(({ planes }) => planes.length);
    await this.tick();
    this.shown.forEach(({ view }, i) => view.set({ ...this.looks(), legend: i === 0 && this.tools.legend.checked }));
    this.shown.forEach((pane) => pane.set("mirror", this.tools.mirror.checked));
    this.fade();
    share(this.shown.map(({ view }) => view));
  }

  pane(run, modules) {
    const pane = new Pane(run, modules, () => this.plane.value);
    pane.view.eye.onMode = () => { this.tools.frame.value = this.view.eye.mode === "part" ? `part ${this.view.eye.part}` : this.view.eye.mode; };
    return pane;
  }

  drop(id, pane) {
    pane.close();
    this.panes.delete(id);
  }

  // Returns the views in the order of their selection; the first view has the legend, and its framed region is used for
  // all.
  get shown() { return this.chosen.map((id) => this.panes.get(id)).filter(Boolean); }

  get view() { return this.shown[0]?.view; }

  get planes() { return this.shown.flatMap(({ planes }) => planes); }

  get t() { return (Number(this.clock.value) / STEPS) * this.end; }

  async tick() {
    const { t } = this;
    this.clockText.textContent = si(t, "s");
    this.clock.setAttribute("aria-valuetext", si(t, "s"));
    await Promise.all(this.shown.map((pane) => pane.show(t)));
    this.offerTools();
    this.paint();
  }

  // Offers the colourings that all bodies have, and the parts of all bodies.
  offerTools() {
    const snapshots = this.shown.map(({ snapshot }) => snapshot).filter(Boolean);
    if (!snapshots.length) return;
    const lists = snapshots.map(colourings);
    this.tools.offer(lists[0].filter((name) => lists.every((list) => list.includes(name))));
    this.tools.offerParts([...new Set(snapshots.flatMap(({ header }) => header.parts))]);
    this.tools.warnOfSize(Math.max(...snapshots.map(({ header }) => header.tets)));
    this.tools.edgeNote.textContent = snapshots.some(({ header, arrays }) => header.surface_triangles > arrays.triangles.length / 3) ? "the surface of a large body is simplified" : "";
    this.tell();
  }

  // Sets one colour scale for all shown bodies; the scale is valid for all times unless the user selects another scale.
  paint() {
    const panes = this.shown.filter(({ snapshot }) => snapshot);
    const { by: { value: by }, choice } = this.tools;
    const field = panes[0]?.snapshot.header.fields[by];
    const ranges = panes.flatMap(({ run }) => run.snapshots).map(({ fields }) => fields?.[by]).filter(Boolean);
    const ends = field && range(choice, by, panes.map(({ snapshot }) => snapshot), ranges);
    if (field) this.tools.ends(ends, field.unit);
    for (const { view } of panes) view.colour(by, ends, field ? choice.bands : 0);
  }

  // Choices ----------------------------------------------------------------------------------------------------------------

  choose() {
    const [first] = this.shown.filter(({ snapshot }) => snapshot);
    if (!first) return;
    this.plane.choose(first.view.eye, first.snapshot.header.box);
    this.slice();
  }

  look(name) {
    if (!this.view) return;
    this.view.eye.view(name);
    if (this.plane.face(this.view.eye)) this.slice();
  }

  slice() {
    for (const pane of this.shown) pane.slice();
    this.tell();
  }

  tell() { this.plane.tell(this.shown.every(({ entry }) => !entry || entry.tets)); }

  fade() {
    const { opacities } = this.tools;
    for (const pane of this.shown) pane.opacities(new Map(this.tools.partNames.map((name, i) => [name, opacities[i]])));
  }

  follow(text) {
    const [mode, part] = text.split(" ");
    this.view?.eye.follow(mode, part === undefined ? null : Number(part));
  }

  // Returns the choices in the panel Show, which every new view gets.
  looks() {
    const { tools } = this;
    return { ...Object.fromEntries(["lines", "edges", "arrows", "axes", "bar"].map((name) => [name, tools[name].checked])), explode: Number(tools.explode.value) };
  }

  set(name, value) {
    for (const pane of name === "legend" ? this.shown.slice(0, 1) : this.shown) pane.set(name, value);
  }

  flip(name) {
    this.tools[name].checked = !this.tools[name].checked;
    this.set(name, this.tools[name].checked);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.view || !act(this, event.key)) return;
    event.preventDefault();
  }

  // Time ----------------------------------------------------------------------------------------------------------------

  step(by) {
    this.pause();
    this.clock.value = Number(this.clock.value) + by;
    this.tick();
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
    for (const pane of this.panes.values()) pane.close();
  }
}
