// Card of the body in 3-D: the view, its tools, the selected fragment, and the snapshots over time.

import { call } from "./api.js";
import { count, counted, h, si } from "./figures.js";
import { act } from "./keys.js";
import { three } from "./libraries.js";
import { Moment } from "./moment.js";
import { Picked, table } from "./picked.js";
import { SectionPlane, symmetry } from "./plane.js";
import { range } from "./ranges.js";
import { film, picture } from "./saving.js";
import { colourings, fragment, partsOf, rowOf, telling } from "./snapshot.js";
import { Snapshots } from "./snapshots.js";
import { Tools } from "./tools.js";
import { View3d } from "./view3d.js";
import { wallsOf } from "./walls.js";

const MOST_KEPT = 40; // Largest number of decoded snapshots in memory, about 1 MB each.
const PLAY = 400; // Time for which a playing film shows each snapshot, ms.

export class Body {
  // `onShow` is called with the snapshot that is shown on the screen.
  constructor(run, onShow = () => {}) {
    Object.assign(this, { run, onShow, entries: [], snapshots: new Snapshots(run, MOST_KEPT), following: true, picked: null, wanted: null, planes: [] });
    // Fulfilled when the first snapshot is drawn, or when no snapshot can be drawn.
    this.drawn = new Promise((done) => { this.ready = done; });
    this.path = `v1/runs/${encodeURIComponent(run)}`;
    this.build();
    three().catch(() => {}); // start() reports an error.
  }

  build() {
    this.holder = h("div.holder3d");
    this.tools = new Tools({
      colour: () => this.paint(), section: () => this.choose(), slice: () => this.slice(), camera: (name) => this.look(name),
      follow: (text) => this.follow(text), set: (name, value) => this.set(name, value), opacities: () => this.view.set({ opacities: this.tools.opacities }),
      save: (kind) => this.save(kind), fragments: () => this.list(),
    });
    this.plane = new SectionPlane(this.tools);
    this.card = new Picked(() => this.pick(-1), (id) => this.history(id));
    this.scrub = h("input", { type: "range", min: 0, step: 1, max: 0, value: 0, "aria-label": "snapshot" });
    this.playing = h("button.quiet", { type: "button" }, "Play");
    this.note = h("span.note");
    this.moment = new Moment(() => this.entries.map(({ t }) => t), (place) => this.go(place));
    this.bar = h("div.scrub", {}, this.playing, this.scrub, this.moment.element);
    this.element = h("section.card.body3d", { "aria-label": "the body", hidden: "" },
      h("div.card-head", {}, h("h2", {}, "The body"), this.note), this.tools.element, h("div.frame3d", {}, this.holder, h("div.aside3d", {}, this.tools.cutting)), this.bar);
    this.listen();
  }

  listen() {
    this.scrub.oninput = () => this.step(0);
    this.playing.onclick = () => (this.player ? this.pause() : this.play());
  }

  // Takes all snapshots of the run so far, from the messages of the run. The newest snapshot is shown unless the user
  // has chosen an earlier one.
  update(entries) {
    if (entries.length <= this.entries.length) return;
    const first = !this.entries.length;
    this.entries = [...entries];
    this.element.hidden = false;
    this.scrub.max = entries.length - 1;
    if (this.following) this.show(entries.length - 1);
    if (first) this.start();
  }

  async start() {
    try {
      const [modules, plan] = await Promise.all([three(), call(`${this.path}/files/case.resolved.json`).catch(() => null)]);
      if (this.closed) return;
      this.planes = symmetry(plan);
      this.tools.mirrorLine.hidden = !this.planes.length;
      this.view = new View3d(modules, (row) => this.pick(row));
      this.view.set({ cuts: this.planes });
      this.view.stand(wallsOf(plan));
      this.tools.wallLine.hidden = !wallsOf(plan).length;
      this.view.eye.onMode = () => { this.tools.frame.value = this.view.eye.mode === "part" ? `part ${this.view.eye.part}` : this.view.eye.mode; };
      Object.assign(this.view.canvas, { tabIndex: 0 });
      this.view.canvas.setAttribute("role", "application");
      this.view.canvas.setAttribute("aria-label", "the body in 3-D; arrow keys turn it, plus and minus zoom, more keys are listed under Camera");
      this.view.canvas.addEventListener("keydown", (event) => this.key(event));
      this.holder.append(this.view.element);
      if (this.snapshot) this.present(this.snapshot, this.volume);
    } catch (error) {
      this.holder.replaceChildren(h("p.hint", {}, `No 3-D: ${error.message}`));
      this.ready();
    }
  }

  // Snapshots -----------------------------------------------------------------------------------------------------------

  // If the slider moves faster than the network, only the last requested snapshot is fetched.
  async show(place) {
    this.scrub.value = place;
    this.moment.show(this.entries[place].t);
    this.wanted = place;
    if (this.fetching) return this.fetching;
    this.fetching = this.fetch();
    await this.fetching;
    return (this.fetching = null);
  }

  async fetch() {
    try {
      while (this.wanted !== null) {
        const entry = this.entries[this.wanted];
        this.wanted = null;
        const [snapshot, volume] = await Promise.all([this.snapshots.read(entry), this.plane.on ? this.snapshots.volume(entry) : null]);
        this.entry = entry;
        if (!this.closed) this.present(snapshot, volume);
      }
    } catch (error) {
      this.note.textContent = error.message;
      this.ready();
    }
  }

  present(snapshot, volume) {
    Object.assign(this, { snapshot, volume });
    const { header, arrays } = snapshot;
    this.note.textContent = `${si(header.t, "s")} · step ${count(header.step)} · ${counted(header.fragments_total, "fragment")} · ${counted(arrays.triangles.length / 3, "triangle")}`;
    this.scrub.setAttribute("aria-valuetext", si(header.t, "s"));
    this.onShow(snapshot);
    this.offer();
    if (!this.view) return;
    this.view.look.caption = si(header.t, "s");
    this.view.show(snapshot);
    if (volume && this.plane.on) this.view.fill(volume);
    this.paint();
    this.tell();
    this.pick(this.picked === null ? -1 : rowOf(snapshot, this.picked), true);
    this.list();
    this.element.dataset.shown = header.n;
    requestAnimationFrame(() => setTimeout(this.ready)); // Called after the frame that draws the snapshot.
  }

  offer() {
    const { header, arrays } = this.snapshot;
    this.tools.offer(colourings(this.snapshot), telling(this.snapshot));
    this.tools.offerParts(header.parts);
    this.tools.warnOfSize(header.tets);
    this.tools.edgeNote.textContent = header.surface_triangles > arrays.triangles.length / 3 ? `the surface is simplified: ${counted(header.surface_triangles, "face")} of the mesh` : "";
  }

  // Choices -------------------------------------------------------------------------------------------------------------

  paint() {
    if (!this.view?.snapshot) return;
    const by = this.tools.by.value;
    const field = this.snapshot.header.fields[by];
    if (!field) return this.view.colour(by);
    const ranges = this.entries.map(({ fields }) => fields?.[by]).filter(Boolean);
    const ends = range(this.tools.choice, by, [this.snapshot], ranges);
    this.tools.ends(ends, field.unit);
    return this.view.colour(by, ends, this.tools.choice.bands);
  }

  async choose() {
    this.plane.choose(this.view.eye, this.snapshot.header.box);
    this.slice();
    if (!this.plane.on) return;
    this.volume = await this.snapshots.volume(this.entry).catch(() => null);
    if (this.volume && this.volume.header.n === this.snapshot.header.n) this.view.fill(this.volume);
    this.tell();
  }

  // After a view across the section, the side of the plane towards the camera is cut away.
  look(name) {
    this.view.eye.view(name);
    if (this.plane.face(this.view.eye)) this.slice();
  }

  slice() {
    this.view.slice(this.plane.value);
    this.tell();
  }

  tell() { this.plane.tell(this.entry.tets || this.volume); }

  follow(text) {
    const [mode, part] = text.split(" ");
    this.view.eye.follow(mode, part === undefined ? null : Number(part));
  }

  set(name, value) {
    this.view.set(name === "mirror" ? { mirrors: value ? this.planes : [], cuts: value ? [] : this.planes } : { [name]: value });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !act(this, event.key)) return;
    event.preventDefault();
  }

  flip(name) {
    this.tools[name].checked = !this.tools[name].checked;
    this.set(name, this.tools[name].checked);
  }

  step(by) { this.go(Math.min(Math.max(Number(this.scrub.value) + by, 0), this.entries.length - 1)); }

  go(place) {
    this.pause();
    this.following = place === this.entries.length - 1;
    this.show(place);
  }

  // Fragments -----------------------------------------------------------------------------------------------------------

  // With `kept`, the selection stays in a new snapshot; the new snapshot may lack the fragment.
  pick(row, kept = false) {
    const found = row >= 0 ? fragment(this.snapshot, row) : null;
    this.view.mark(row);
    this.card.show(found, this.snapshot.header.t, found && partsOf(this.snapshot)[row]);
    if (found || !kept) this.picked = found ? found.id : null;
    this.list();
  }

  list() {
    if (!this.tools.fragments.open || !this.snapshot) return;
    const row = this.picked === null ? -1 : rowOf(this.snapshot, this.picked);
    const { heaviest } = this.tools;
    const focused = heaviest.contains(document.activeElement) && document.activeElement.innerText;
    heaviest.replaceChildren(...table(this.snapshot, row, (chosen) => this.pick(chosen)));
    if (focused) [...heaviest.querySelectorAll("button")].find(({ innerText }) => innerText === focused)?.focus({ preventScroll: true });
  }

  // Returns { t, mass, speed } of a fragment over time: from the server, or from the snapshots in memory.
  async history(id) {
    return call(`${this.path}/fragments/${id}`).catch(() => this.remembered(id));
  }

  remembered(id) {
    const rows = [...this.snapshots.shown.values()].map((one) => [one.header.t, one, rowOf(one, id)]).filter(([, , row]) => row >= 0).sort((a, b) => a[0] - b[0]);
    const each = rows.map(([, one, row]) => fragment(one, row));
    return { t: rows.map(([t]) => t), mass: each.map(({ mass }) => mass), speed: each.map(({ velocity }) => Math.hypot(...velocity)) };
  }

  // Time ----------------------------------------------------------------------------------------------------------------

  play() {
    if (Number(this.scrub.value) >= this.entries.length - 1) this.show(0);
    this.following = false;
    this.playing.textContent = "Pause";
    this.player = setInterval(() => {
      const next = Number(this.scrub.value) + 1;
      if (next >= this.entries.length) this.pause();
      else if (!this.fetching) this.show(next);
    }, PLAY);
  }

  pause() {
    clearInterval(this.player);
    this.player = null;
    this.playing.textContent = "Play";
    this.following = Number(this.scrub.value) === this.entries.length - 1;
  }

  async save(kind) {
    const name = `${this.run}-${this.tools.by.value}`;
    if (kind === "picture") return picture(this.view, `${name}-${String(this.snapshot.header.n).padStart(3, "0")}`);
    if (this.filmed) return this.filmed.abort();
    this.pause();
    this.following = false;
    this.filmed = new AbortController();
    await this.tools.whileFilming((report) => film(this.view, name, this.entries.length, (i) => this.show(i), (i) => report(`snapshot ${i + 1} of ${this.entries.length}`), this.filmed.signal));
    return (this.filmed = null);
  }

  close() {
    this.closed = true;
    this.filmed?.abort();
    clearInterval(this.player);
    this.view?.close();
  }
}
