// Tools of the 3-D view: colour, section, camera, scale, parts, display, fragments, saving. The browser stores the
// choices.

import { named } from "./colours.js";
import { VIEW_NAMES } from "./camera.js";
import { count, h, si, words } from "./figures.js";
import { hindrance } from "./saving.js";
import { scaleOf } from "./scales.js";

const CUTS = ["none", "x", "y", "z", "as seen"];
const STEPS = 400; // Number of steps of the slider of a section.
// Largest number of tets of a snapshot that has a file of all tets (MOST_TETS of worker/snapshots/volume.py).
const FILLED = 1_000_000;
const SIGNS = { "+": "+", "-": "−" };
const KEYS = {
  "x y z": "look from there", "Shift x y z": "from the other side", i: "isometric", "f, a": "fit the bodies, fit all", "← → ↑ ↓": "turn", "Shift ← →": "move", "+ −": "zoom",
  ", .": "previous, next snapshot", Space: "play", "o, e": "outlines, edges", v: "velocities as arrows", m: "mirror images",
};

export class Tools {
  // `act` has the actions colour(), slice(), camera(name), follow(text), set(changes), opacities(), save(kind),
  // fragments(). `without`: titles of panels that are left out.
  constructor(act, without = []) {
    Object.assign(this, { act, choice: { how: "most", over: "run", hand: null, bands: 0 }, flipped: false, partNames: [] });
    this.by = choice("colour by", ["fragment", "part"], () => act.colour());
    this.across = choice("section across", CUTS, () => act.section());
    this.place = h("input", { type: "range", "aria-label": "place of the section", min: 0, max: 1, step: "any", value: 0.5, oninput: () => act.slice() });
    this.position = h("output.place");
    this.flip = button("Flip", "cut away the other side", () => { this.flipped = !this.flipped; act.slice(); });
    this.parts = h("div.parts");
    this.heaviest = h("div.scroll", { tabindex: 0, role: "region", "aria-label": "the heaviest fragments" });
    this.fragments = panel("Fragments", this.heaviest);
    this.fragments.addEventListener("toggle", () => act.fragments());
    const panels = { Camera: panel("Camera", this.camera()), Scale: panel("Scale", this.scale()), Parts: panel("Parts", this.parts), Show: panel("Show", this.show()), Fragments: this.fragments, Save: panel("Save", this.save()) };
    this.panels = Object.entries(panels).filter(([title]) => !without.includes(title)).map(([, one]) => one);
    this.limit = h("span.hint.limit", { role: "status" });
    this.cutting = h("span.cutting", { hidden: "" }, this.place, this.position, this.flip);
    this.element = h("div.tools3d", { role: "toolbar", "aria-label": "tools of the body" }, field("Colour", this.by), field("Section", this.across), this.limit, this.panels);
    this.element.addEventListener("keydown", (event) => { if (event.key === "Escape") this.leave(); });
    for (const one of this.panels) one.addEventListener("toggle", () => { if (one.open) this.shut(one); });
  }

  // Returns the focus to the button of the open panel.
  leave() {
    const open = this.panels.find((one) => one.open);
    this.shut();
    open?.querySelector("summary").focus();
  }

  shut(except) {
    for (const one of this.panels) if (one !== except) one.open = false;
  }

  camera() {
    const buttons = VIEW_NAMES.map((name) => button(name.replace(/^[+-]/, (sign) => SIGNS[sign]), `look from ${name}`, () => this.act.camera(name)));
    this.frame = choice("what the frame follows", ["fit", "all", "free"], () => this.act.follow(this.frame.value));
    this.frames([]);
    return h("div.lines", {}, h("div.buttons", {}, buttons), field("Frame", this.frame), h("dl.keys", {}, Object.entries(KEYS).map(([keys, what]) => h("div", {}, h("dt", {}, keys), h("dd", {}, what)))));
  }

  // Offers the parts that the camera can follow.
  frames(parts) {
    const names = { fit: "fits the bodies", all: "fits all, with debris", free: "stays" };
    const before = this.frame.value;
    this.frame.replaceChildren(...Object.entries(names).map(([value, name]) => h("option", { value }, name)),
      ...parts.map((name, i) => h("option", { value: `part ${i}` }, `follows ${name}`)));
    this.frame.value = before;
  }

  scale() {
    const set = () => {
      const hand = [this.low, this.high].map((input) => Number(input.value) * (this.worth ?? 1));
      const whole = this.low.value !== "" && this.high.value !== "" && hand.every(Number.isFinite) && hand[0] < hand[1];
      this.choice = { how: this.how.value, over: this.over.value, hand: whole ? hand : null, bands: Number(this.bands.value) };
      this.low.disabled = this.high.disabled = this.how.value !== "hand";
      this.over.disabled = this.how.value === "hand";
      this.act.colour();
    };
    this.how = worded("ends of the scale", { most: "all but the extremes (0.5 %)", all: "least to largest", hand: "by hand" }, set);
    this.over = worded("over which snapshots", { run: "the whole run", now: "this snapshot" }, set);
    this.bands = worded("bands of the scale", { 0: "smooth", 6: "6 bands", 10: "10 bands", 16: "16 bands" }, set);
    this.low = h("input", { type: "number", step: "any", "aria-label": "low end of the scale", disabled: "", onchange: set });
    this.high = h("input", { type: "number", step: "any", "aria-label": "high end of the scale", disabled: "", onchange: set });
    this.unit = h("span.hint");
    return h("div.lines", {}, field("Ends", this.how), field("Over", this.over), field("From", this.low), field("to", this.high, this.unit), field("Colours", this.bands));
  }

  // Writes the ends of the colour scale into the inputs, with their unit beside the fields.
  ends({ low, high }, unit) {
    const [shown, name] = si(Math.max(Math.abs(low), Math.abs(high)), unit).split(" ");
    this.unit.textContent = name ?? "";
    this.worth = 10 ** Math.round(Math.log10(Math.max(Math.abs(low), Math.abs(high)) / Number(shown))) || 1;
    if (this.how.value === "hand" && this.low.value !== "") return;
    [this.low.value, this.high.value] = [low, high].map((end) => rounded(end / this.worth));
  }

  offerParts(parts) {
    if (parts.join("\n") === this.partNames.join("\n")) return;
    this.partNames = parts;
    this.shares = parts.map((name, i) => h("input", { type: "range", min: 0, max: 1, step: 0.05, value: 1, "aria-label": `opacity of ${name}`, oninput: () => this.act.opacities() }));
    this.parts.replaceChildren(...parts.map((name, i) => h("div.part", {},
      h("label", {}, h("input", { type: "checkbox", checked: "", "aria-label": `show ${name}`, onchange: ({ target }) => { this.shares[i].value = target.checked ? 1 : 0; this.act.opacities(); } }),
        h("i.key", { style: { background: named(i) } }), name), this.shares[i])));
    this.frames(parts);
  }

  get opacities() { return (this.shares ?? []).map(({ value }) => Number(value)); }

  show() {
    const box = (name, label, on) => (this[name] = h("input", { type: "checkbox", ...(on ? { checked: "" } : {}), onchange: () => this.act.set(name, this[name].checked), "aria-label": label }));
    const line = (name, label, on) => h("label.check", {}, box(name, label, on), label);
    this.explode = h("input", { type: "range", min: 0, max: 2, step: 0.01, value: 0, "aria-label": "explode", oninput: () => this.act.set("explode", Number(this.explode.value)) });
    this.edgeNote = h("p.hint");
    this.mirrorLine = line("mirror", "mirror images", false);
    this.mirrorLine.hidden = true;
    this.wallLine = line("walls", "rigid walls", true);
    this.wallLine.hidden = true;
    return h("div.lines", {}, line("lines", "outlines of fragments", true), line("edges", "edges of the mesh", false), this.edgeNote,
      this.mirrorLine, this.wallLine, line("arrows", "velocities as arrows", false), line("axes", "axes", true), line("bar", "scale bar", true), line("legend", "legend", true), field("Pull apart", this.explode));
  }

  save() {
    this.filming = button("Film", "save a film of the snapshots (WebM)", () => this.act.save("film"));
    this.saved = h("p.hint", { role: "status" });
    return h("div.lines", {}, h("div.buttons", {}, button("Picture", "save a picture (PNG)", () => this.act.save("picture")), this.filming), this.saved);
  }

  // Calls `make`, which makes a film and reports its progress; the result is shown beside the button.
  async whileFilming(make) {
    const problem = hindrance();
    this.saved.textContent = problem;
    if (problem) return;
    this.filming.textContent = "Stop";
    const ended = await make((text) => { this.saved.textContent = text; }).catch((error) => error.message);
    this.saved.textContent = ended;
    this.filming.textContent = "Film";
  }

  // Offers the names of fields to colour by, `list`; `first` is the default.
  offer(list, first = "fragment") {
    if (list.join() === [...this.by.options].map(({ value }) => value).join()) return;
    const before = this.offered ? this.by.value : first;
    this.offered = true;
    this.by.replaceChildren(...list.map((name) => h("option", { value: name }, ["fragment", "part", "rank"].includes(name) ? name : scaleOf(name).label)));
    this.by.value = list.includes(before) ? before : "fragment";
  }

  // Writes a note beside the choice of a section that sections are not filled, before the user chooses a section.
  // `tets`: largest number of tets of a body.
  warnOfSize(tets) {
    this.limit.textContent = tets > FILLED ? `hollow: only bodies of up to ${count(FILLED)} tets have filled sections` : "";
  }

  // Sets the slider: it goes from `low` to `high`, m, and its value is `at`.
  slide(low, high, at) {
    Object.assign(this.place, { min: low, max: high, step: (high - low) / STEPS || "any" });
    this.place.value = at;
    this.cutting.hidden = false;
  }

  // Returns the position of the slider, m.
  get at() {
    const { value, min, max } = this.place;
    return Math.abs(value) < 1e-6 * (max - min) ? 0 : Number(value);
  }

  // Writes the position of the section beside the slider.
  tell(at, hollow) {
    this.position.textContent = at === null ? "" : `${si(at, "m")}${hollow ? ", hollow" : ""}`;
    this.position.title = hollow;
    this.cutting.hidden = at === null;
  }
}

const rounded = (value) => Math.round(value * 1e4) / 1e4;
const button = (text, label, onclick) => h("button.quiet", { type: "button", "aria-label": label, title: label, onclick }, text);
const field = (text, ...inputs) => h("label.field", {}, h("span", {}, text), ...inputs);
const panel = (title, content) => h("details.panel", {}, h("summary", {}, title), h("div.sheet", {}, content));
const choice = (label, names, onchange) => h("select", { "aria-label": label, onchange }, names.map((name) => h("option", { value: name }, words(name))));
const worded = (label, names, onchange) => h("select", { "aria-label": label, onchange }, Object.entries(names).map(([value, name]) => h("option", { value }, name)));
