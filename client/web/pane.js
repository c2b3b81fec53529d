// The 3-D view of one of several runs side by side: the snapshot nearest to a time, cut and coloured as in the other
// views.

import { counted, h, si } from "./figures.js";
import { swatch } from "./linestyles.js";
import { symmetry } from "./plane.js";
import { Snapshots } from "./snapshots.js";
import { View3d } from "./view3d.js";
import { wallsOf } from "./walls.js";

const MOST_KEPT = 24; // Largest number of decoded snapshots in memory for each run.
// Largest difference between the time of a snapshot and the common time for which no note is shown, relative to the
// time of the last snapshot.
const ALIKE = 0.01;

// Returns the snapshot nearest to a time.
export const nearestTo = (entries, t) => entries.reduce((best, one) => (Math.abs(one.t - t) < Math.abs(best.t - t) ? one : best));

export class Pane {
  // `run`: { id, snapshots, line, called, plan }. `modules`: result of libraries.three(). `cut()` returns the common
  // section of all views.
  constructor(run, modules, cut) {
    Object.assign(this, { run, cut, store: new Snapshots(run.id, MOST_KEPT), planes: symmetry(run.plan), wanted: null });
    this.view = new View3d(modules);
    this.view.set({ cuts: this.planes });
    this.view.stand(wallsOf(run.plan));
    this.view.canvas.tabIndex = 0;
    this.view.canvas.setAttribute("role", "application");
    this.view.canvas.setAttribute("aria-label", `the body of ${run.called}; arrow keys turn all bodies, plus and minus zoom, more keys are listed under Camera`);
    this.caption = h("figcaption", {});
    this.element = h("figure.pane", {}, h("div.pane-name", {}, swatch(run.line), run.called), this.view.element, this.caption);
  }

  // If the time changes faster than the network, only the last requested snapshot is fetched.
  async show(t) {
    this.wanted = t;
    if (this.busy) return;
    this.busy = true;
    try {
      while (this.wanted !== null && !this.closed) await this.fetch();
    } catch (error) {
      this.caption.textContent = error.message;
    } finally {
      this.busy = false;
    }
  }

  async fetch() {
    const wanted = this.wanted;
    const entry = nearestTo(this.run.snapshots, wanted);
    this.wanted = null;
    this.caption.textContent = `${si(entry.t, "s")}${off(entry.t - wanted, this.run.snapshots.at(-1).t)} · ${counted(entry.fragments, "fragment")}`;
    if (this.entry === entry) return;
    const snapshot = await this.store.read(entry);
    if (this.closed) return;
    Object.assign(this, { entry, snapshot });
    this.view.show(snapshot);
    await this.slice();
  }

  // Cuts the body, and fills the section with the field if the snapshot has a file of all tets.
  async slice() {
    const section = this.cut();
    this.view.slice(section);
    if (!section || !this.entry) return;
    const volume = await this.store.volume(this.entry).catch(() => null);
    if (volume && !this.closed && volume.header.n === this.snapshot.header.n) this.view.fill(volume);
  }

  // Sets the opacities of parts by the names of the parts.
  opacities(of) {
    if (this.snapshot) this.view.set({ opacities: this.snapshot.header.parts.map((name) => of.get(name) ?? 1) });
  }

  set(name, value) {
    this.view.set(name === "mirror" ? { mirrors: value ? this.planes : [], cuts: value ? [] : this.planes } : { [name]: value });
  }

  close() {
    this.closed = true;
    this.view.close();
  }
}

// Returns a note if the time of the nearest snapshot differs much from the requested time: snapshots of two runs have
// different times.
const off = (late, end) => (Math.abs(late) > ALIKE * end ? ` (the nearest snapshot, ${si(Math.abs(late), "s")} ${late > 0 ? "later" : "earlier"})` : "");
