// The 3-D view: a canvas for the picture, and above it a canvas for axes, scale bar and legend. The picture is drawn
// only after a change. A view fills its element. Several views may exist; share() of camera.js couples their cameras.

import { Arrows } from "./arrows.js";
import { ViewCamera } from "./camera.js";
import { h } from "./figures.js";
import { Outlines } from "./outlines.js";
import { draw as drawOver } from "./overlay.js";
import { ramp, scaleOf } from "./scales.js";
import { css, ofFragment, ofName } from "./colours.js";
import { Surface } from "./surface.js";
import { WALL, Walls } from "./walls.js";

const MANY = 60_000; // Number of triangles above which lines are drawn only after the body has stopped moving.
const STILL = 160; // Time in ms without movement after which the body counts as standing still.

export class View3d {
  // `modules` is the result of libraries.three(); `onPick` is called with the row of a fragment, or -1.
  constructor(modules, onPick = () => {}) {
    const { THREE } = modules;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.autoClear = this.renderer.info.autoReset = false;
    this.canvas = this.renderer.domElement;
    this.over = h("canvas.over", { "aria-hidden": "true" });
    this.element = h("div.view3d", {}, this.canvas, this.over);
    this.look = { explode: 0, mirrors: [], cuts: [], opacities: [], lines: true, edges: false, walls: true, arrows: false, axes: true, bar: true, legend: true, caption: "" };
    this.surface = new Surface(THREE);
    this.outlines = new Outlines(THREE);
    this.arrows = new Arrows(THREE);
    this.extras = new THREE.Scene();
    this.walls = new Walls(THREE);
    this.extras.add(this.arrows.mesh, this.walls.group);
    this.point = new THREE.WebGLRenderTarget(1, 1);
    this.eye = new ViewCamera(modules, this.canvas, () => this.turned(), () => ({ ...this.look, snapshot: this.snapshot, shown: (part) => this.opacity(part) > 0.005 }));
    this.picked = -1;
    this.pickable(onPick);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.theme = () => { this.tones = null; this.later(); };
    this.dark.addEventListener("change", this.theme);
    this.watch = new ResizeObserver(() => this.resize());
    this.watch.observe(this.element);
  }

  // View state ------------------------------------------------------------------------------------------------------------

  show(snapshot) {
    this.snapshot = snapshot;
    this.surface.show(snapshot);
    this.surface.slice(this.section ?? null);
    this.walls.show(snapshot);
    this.colour(this.by ?? "fragment", this.range, this.bands);
    this.pointers();
    if (this.sized) this.eye.keep();
    this.later();
  }

  // Takes all tets of the shown snapshot (section.js), for filled sections.
  fill(volume) {
    this.surface.volume = volume;
    this.surface.cutAll();
    this.later();
  }

  // Sets the colouring. `range`: { low, high, number } of the scale of a field; `bands`: number of colour bands, 0 for
  // a continuous scale.
  colour(by, range, bands = 0) {
    Object.assign(this, { by, range, bands });
    this.surface.colour(by, range, bands);
    this.later();
  }

  // Takes the rigid walls of the case (walls.js).
  stand(list) {
    this.walls.take(list);
    if (this.snapshot) this.walls.show(this.snapshot);
    this.later();
  }

  // Sets any of the members of `look`: explode, mirrors and cuts ({ axis, at } each), opacities by part, lines, edges,
  // walls, arrows, axes, bar, legend, caption.
  set(changes) {
    Object.assign(this.look, changes);
    this.surface.shared.explode.value = this.look.explode;
    this.surface.shared.edges.value = this.look.edges ? 0.5 : 0;
    this.walls.group.visible = this.look.walls;
    if ("opacities" in changes) this.surface.opacities(this.look.opacities);
    if (!this.snapshot) return;
    if ("mirrors" in changes) {
      this.surface.reflect(this.look.mirrors);
      this.surface.cutAll();
    }
    this.pointers();
    if ("mirrors" in changes || "explode" in changes || "opacities" in changes) this.eye.keep();
    this.later();
  }

  // Cuts away the material beyond the plane `normal` · x = `at`, m; null cuts nothing.
  slice(section) {
    this.section = section;
    if (!this.snapshot) return;
    this.surface.slice(section);
    this.pointers();
    this.later();
  }

  // Draws the arrows; `fastest` is the largest speed of the arrows.
  pointers() {
    if (!this.look.arrows) return this.arrows.hide();
    const { normal, at } = this.section ?? {};
    const kept = (place) => !normal || normal[0] * place[0] + normal[1] * place[1] + normal[2] * place[2] <= at;
    this.fastest = this.arrows.show(this.snapshot, {
      explode: this.look.explode, middle: this.surface.shared.middle.value.toArray(), mirrors: this.look.mirrors,
      keep: (part, place) => this.opacity(part) > 0.005 && kept(place), ink: this.inks().ink, reach: this.eye.reach(),
    });
    return this.fastest;
  }

  opacity(part) { return this.look.opacities[part] ?? 1; }

  mark(row) {
    this.picked = row;
    this.later();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!width || !height) return;
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    Object.assign(this.over, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    this.outlines.size(this.canvas.width, this.canvas.height, ratio);
    this.sized = { width, height, ratio };
    this.eye.aspect(width, height);
    if (this.snapshot && !this.eye.direction) this.eye.keep();
    this.draw();
  }

  // Frames --------------------------------------------------------------------------------------------------------------

  later() {
    if (this.due || this.closed) return;
    this.due = true;
    requestAnimationFrame(() => this.draw());
  }

  // A large body is drawn without lines while it turns.
  turned() {
    if (this.snapshot?.arrays.triangles.length > 3 * MANY) {
      clearTimeout(this.still);
      this.moving = true;
      this.still = setTimeout(() => { this.moving = false; this.later(); }, STILL);
    }
    this.later();
  }

  // Draws the view; with `captioned`, the time is in the picture, as in saved pictures. The browser's timeline has the
  // script time of each drawing as "conoid:frame", with the number of draw calls.
  draw(captioned = false) {
    this.due = false;
    if (this.closed || !this.snapshot || !this.sized) return;
    const start = performance.now();
    const { renderer, surface, eye: { camera }, look } = this;
    const tones = this.inks();
    surface.shared.ink.value.setRGB(...tones.ink);
    renderer.info.reset();
    renderer.setRenderTarget(null);
    renderer.setClearColor(0, 0);
    renderer.clear();
    surface.draw(renderer, camera);
    if (this.arrows.mesh.visible || this.walls.seen) renderer.render(this.extras, camera);
    const lines = look.lines && !this.moving && this.begun;
    if (lines || this.picked >= 0) {
      this.outlines.draw(renderer, () => surface.numbers(renderer, camera), camera, { picked: this.picked, lines, ink: tones.ink });
    }
    this.drawOver(captioned);
    if (!this.begun) this.later(); // Without lines the first picture is on the screen earlier.
    this.begun = true;
    performance.measure("conoid:frame", { start, detail: { calls: renderer.info.render.calls } });
    performance.clearMeasures("conoid:frame");
  }

  drawOver(captioned) {
    const { width, height, ratio } = this.sized;
    const { ink, soft, paper } = this.inks().css;
    const ctx = this.over.getContext("2d");
    ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { axes, bar, caption } = this.look;
    drawOver(ctx, { width, height, camera: this.eye.camera, distance: this.eye.distance, axes, bar, caption: captioned && caption, ink, soft, paper, legend: this.look.legend ? this.legend() : null });
  }

  legend() {
    const { by, range, snapshot: { header } } = this;
    const field = header.fields[by];
    const arrows = this.look.arrows && this.fastest ? this.fastest : 0;
    if (field) return { title: scaleOf(by).label, unit: field.unit, ...range, colours: ramp(scaleOf(by).colours, this.bands), arrows };
    const pieces = header.fragments_total > header.parts.length;
    const tones = (i) => (by === "fragment" ? [ofFragment(BigInt(i), i, header.parts.length), ...(pieces ? [ofName(i)] : [])] : [ofName(i)]).map(css);
    const list = by === "rank" ? Array.from({ length: header.ranks }, (_, rank) => `rank ${rank}`) : header.parts;
    const walls = this.walls.seen ? [{ name: "rigid wall", colours: [WALL] }] : [];
    return { title: by === "fragment" && pieces ? "whole bodies | pieces" : by === "fragment" ? "bodies" : by, names: [...list.map((name, i) => ({ name, colours: tones(i) })), ...walls], arrows };
  }

  // Returns the colours of the page; they are read once for each theme.
  inks() {
    if (this.tones) return this.tones;
    const style = getComputedStyle(this.element);
    const css = Object.fromEntries(["ink", "soft", "paper"].map((name) => [name, style.getPropertyValue(`--${name}`).trim() || "#808080"]));
    const ink = /^#[0-9a-f]{6}/i.test(css.ink) ? [1, 3, 5].map((at) => parseInt(css.ink.slice(at, at + 2), 16) / 255) : [0.1, 0.1, 0.1];
    this.tones = { css, ink: ink.map((share) => share * 0.9) };
    return this.tones;
  }

  // Picking -------------------------------------------------------------------------------------------------------------

  pickable(onPick) {
    let down = null;
    this.canvas.addEventListener("pointerdown", (event) => { down = [event.offsetX, event.offsetY]; });
    this.canvas.addEventListener("click", (event) => {
      const still = down && Math.hypot(event.offsetX - down[0], event.offsetY - down[1]) < 4;
      if (still && this.snapshot) onPick(this.pick(event.offsetX, event.offsetY));
    });
    this.canvas.addEventListener("keydown", (event) => {
      if (!event.ctrlKey && !event.metaKey && !event.altKey && this.eye.key(event.key, event.shiftKey)) event.preventDefault();
    });
  }

  // Returns the row of the fragment at a position of the canvas (CSS pixels), or -1 outside of the body. For this
  // purpose one pixel is drawn with row numbers.
  pick(x, y) {
    const { renderer, surface, eye: { camera } } = this;
    const pixel = new Uint8Array(4);
    camera.setViewOffset(this.sized.width, this.sized.height, x, y, 1, 1);
    renderer.setRenderTarget(this.point);
    renderer.setClearColor(0, 0);
    renderer.clear();
    surface.numbers(renderer, camera, [-1, ...surface.ghosts(camera)]);
    renderer.readRenderTargetPixels(this.point, 0, 0, 1, 1, pixel);
    renderer.setRenderTarget(null);
    camera.clearViewOffset();
    return pixel[2] >= 254 ? pixel[0] + 256 * pixel[1] : -1;
  }

  close() {
    this.closed = true;
    clearTimeout(this.still);
    this.watch.disconnect();
    this.dark.removeEventListener("change", this.theme);
    this.eye.controls.dispose();
    for (const one of [this.surface, this.outlines, this.arrows, this.walls, this.point]) (one.close ?? one.dispose).call(one);
    this.renderer.dispose();
  }
}
