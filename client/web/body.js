// The card of the breaking body: the view, what colours and cuts it, a picked fragment, and the snapshots over time.

import { binary } from "./api.js";
import { SCALE_CSS, named } from "./colours.js";
import { alike, count, counted, h, si, vector, words } from "./figures.js";
import { three } from "./libraries.js";
import { colourings, decode, fragment, rowOf } from "./snapshot.js";
import { View3d } from "./view3d.js";

const MOST_KEPT = 40; // Decoded snapshots, about 1 MB each.
const MOST_NAMED = 12; // Ranks or parts in the legend.
const PLAY = 400; // ms for each snapshot.
const HEAVIEST = 30; // Fragments that can be chosen by name.
const AXES = ["x", "y", "z"];

export class Body {
  // `onShow` gets the snapshot that is on the screen.
  constructor(run, onShow) {
    Object.assign(this, { run, onShow, entries: [], kept: new Map(), ranges: {}, following: true, picked: null, wanted: null });
    this.build();
  }

  build() {
    const input = (label, attributes) => h("input", { type: "range", min: 0, step: 0.01, "aria-label": label, ...attributes });
    const choice = (label, names) => h("select", { "aria-label": label }, names.map((name) => h("option", { value: name }, words(name))));
    this.holder = h("div.view3d");
    this.by = choice("colour by", ["fragment", "rank", "part"]);
    this.explode = input("explode", { max: 2, value: 0 });
    this.axis = choice("section across", ["none", ...AXES]);
    this.cut = input("place of the section", { max: 1, value: 0.5, disabled: "" });
    this.chosen = h("select", { "aria-label": "fragment" });
    this.scrub = input("snapshot", { max: 0, step: 1, value: 0 });
    this.playing = h("button.quiet", { type: "button" }, "Play");
    this.key = h("div.scale");
    this.row = h("dl.facts.row", { hidden: "" });
    this.note = h("span.note");
    const field = (text, ...inputs) => h("label.field", {}, h("span", {}, text), ...inputs);
    this.controls = h("div.controls", {},
      field("Colour", this.by), this.key, field("Explode", this.explode), field("Section", this.axis), this.cut, field("Fragment", this.chosen));
    this.bar = h("div.scrub", {}, this.playing, this.scrub);
    this.element = h("section.card.wide", { "aria-label": "the body", hidden: "" },
      h("div.card-head", {}, h("h2", {}, "The body"), this.note), this.holder, this.bar, this.controls, this.row);
    this.listen();
  }

  listen() {
    this.by.onchange = () => this.paint();
    this.explode.oninput = () => this.view?.set("explode", Number(this.explode.value));
    this.axis.onchange = this.cut.oninput = () => this.slice();
    this.chosen.onchange = () => this.pick(Number(this.chosen.value));
    this.scrub.oninput = () => {
      this.pause();
      this.following = Number(this.scrub.value) === this.entries.length - 1;
      this.show(Number(this.scrub.value));
    };
    this.playing.onclick = () => (this.player ? this.pause() : this.play());
  }

  // All snapshots of the run so far: [{ n, t, fragments, … }]. The newest is shown, unless an earlier one was chosen.
  update(entries) {
    if (entries.length === this.entries.length) return;
    const first = !this.entries.length;
    this.entries = [...entries];
    this.element.hidden = false;
    this.scrub.max = entries.length - 1;
    if (this.following) this.show(entries.length - 1);
    if (first) this.start();
  }

  async start() {
    try {
      this.view = new View3d(await three(), (row) => this.pick(row));
      Object.assign(this.view.canvas, { tabIndex: 0 });
      this.view.canvas.setAttribute("role", "application");
      this.view.canvas.setAttribute("aria-label", "the body in 3-D; arrow keys turn it, plus and minus zoom");
      this.holder.append(this.view.canvas);
      if (this.snapshot) this.present(this.snapshot);
    } catch (error) {
      this.holder.replaceChildren(h("p.hint", {}, `No 3-D: ${error.message}`));
    }
  }

  // Only the place asked for last is fetched, when scrubbing is faster than the network.
  async show(place) {
    this.scrub.value = place;
    this.wanted = place;
    if (this.fetching) return;
    this.fetching = true;
    try {
      while (this.wanted !== null) {
        const entry = this.entries[this.wanted];
        this.wanted = null;
        this.present(await this.read(entry));
      }
    } catch (error) {
      this.note.textContent = error.message;
    } finally {
      this.fetching = false;
    }
  }

  async read({ n }) {
    const found = this.kept.get(n) ?? decode(await binary(`v1/runs/${encodeURIComponent(this.run)}/snapshots/${n}`));
    this.kept.delete(n);
    this.kept.set(n, found);
    if (this.kept.size > MOST_KEPT) this.kept.delete(this.kept.keys().next().value);
    return found;
  }

  present(snapshot) {
    this.snapshot = snapshot;
    const { header } = snapshot;
    for (const [name, { low, high }] of Object.entries(header.fields)) {
      const [least, most] = this.ranges[name] ?? [low, high];
      this.ranges[name] = [Math.min(low, least), Math.max(high, most)];
    }
    this.note.textContent = `${si(header.t, "s")} · step ${count(header.step)} · ${counted(header.fragments_total, "fragment")} · ${counted(snapshot.arrays.triangles.length / 3, "triangle")}`;
    this.scrub.setAttribute("aria-valuetext", si(header.t, "s"));
    this.onShow(snapshot);
    this.offer();
    if (!this.view) return;
    this.view.show(snapshot);
    this.paint();
    this.slice();
    this.pick(this.picked === null ? -1 : rowOf(snapshot, this.picked));
    this.element.dataset.shown = header.n;
  }

  offer() {
    const names = colourings(this.snapshot);
    if (this.by.options.length !== names.length) {
      const before = this.by.value;
      this.by.replaceChildren(...names.map((name) => h("option", { value: name }, words(name))));
      this.by.value = names.includes(before) ? before : "fragment";
    }
    const { fragment_id: ids, fragment_mass: masses } = this.snapshot.arrays;
    const rows = [...ids.keys()].sort((a, b) => masses[b] - masses[a]).slice(0, HEAVIEST);
    const weights = alike(rows.map((row) => masses[row]), "kg");
    this.chosen.replaceChildren(h("option", { value: -1 }, "none picked"),
      ...rows.map((row, i) => h("option", { value: row }, ids[row] < 0n ? "the rest" : `${weights[i]} (${ids[row]})`)));
  }

  paint() {
    if (!this.view?.snapshot) return;
    const { fields, parts, ranks } = this.snapshot.header;
    const by = this.by.value;
    const field = fields[by];
    this.view.colour(by, this.ranges[by]);
    const names = by === "part" ? parts : by === "rank" ? Array.from({ length: ranks }, (_, rank) => `rank ${rank}`) : [];
    const legend = h("div.legend", {}, names.slice(0, MOST_NAMED).map((name, i) => h("span", {}, h("i", { style: { background: named(i) } }), name)));
    if (field) {
      const [low, high] = alike(this.ranges[by], field.unit);
      this.key.replaceChildren(h("span", {}, low), h("i", { style: { background: SCALE_CSS } }), h("span", {}, high));
    } else this.key.replaceChildren(legend);
  }

  slice() {
    const axis = AXES.indexOf(this.axis.value);
    this.cut.disabled = axis < 0;
    this.view?.section(axis < 0 ? null : axis, Number(this.cut.value));
  }

  pick(row) {
    const found = row >= 0 ? fragment(this.snapshot, row) : null;
    this.view.set("picked", row);
    if (found || this.picked !== null) this.row.hidden = !found;
    this.picked = found ? found.id : this.picked !== null && this.player ? this.picked : null;
    this.chosen.value = row;
    if (this.chosen.selectedIndex < 0) this.chosen.value = -1;
    if (found) this.row.replaceChildren(...this.facts(found));
  }

  facts(found) {
    const entry = (name, value, broad) => h(broad ? "div.broad" : "div", {}, h("dt", {}, name), h("dd", {}, value));
    return [
      entry("fragment", found.rest ? "the rest" : String(found.id)), entry("mass", si(found.mass, "kg")),
      entry("size", si(found.size, "m")), entry("tets", count(found.tets)),
      entry("birth", found.birth > 0 ? si(found.birth, "s") : "from the start"),
      entry("speed", si(Math.hypot(...found.velocity), "m/s")), entry("velocity", vector([...found.velocity], "m/s"), true),
      entry("centre", vector([...found.centre], "m"), true),
    ];
  }

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

  close() {
    clearInterval(this.player);
    this.view?.close();
  }
}
