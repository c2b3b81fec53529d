// Data of the selected fragment, its mass and speed over the snapshots, and the table of the heaviest fragments.

import { alike, count, h, si, vector } from "./figures.js";
import { partsOf } from "./snapshot.js";

const HEAVIEST = 30;
const [WIDE, TALL] = [200, 40]; // Size of a small chart, px.

const entry = (name, value, broad) => h(broad ? "div.broad" : "div", {}, h("dt", {}, name), h("dd", {}, value));

export class Picked {
  // `onClose` is called when the card is closed; `history(id)` resolves to { t, mass, speed } of a fragment.
  constructor(onClose, history) {
    this.history = history;
    this.list = h("dl.facts");
    this.course = h("div.course");
    const close = h("button.quiet.shut-picked", { type: "button", "aria-label": "close the fragment", onclick: onClose }, "×");
    this.element = h("section.card.picked", { hidden: "", "aria-label": "the selected fragment" }, close, this.list, this.course);
  }

  // Shows a fragment (snapshot.js) of a `part` at the time `t` of the shown snapshot; null hides the card.
  show(found, t, part) {
    this.element.hidden = !found;
    if (!found) return (this.id = null);
    this.list.replaceChildren(...facts(found, part));
    if (this.id !== found.id) this.read(found.id);
    this.id = found.id;
    this.t = t;
    return this.place();
  }

  async read(id) {
    this.data = null;
    this.course.replaceChildren();
    if (id < 0n) return;
    const data = await this.history(id).catch(() => null);
    if (this.id !== id || !data || data.t.length < 2) return;
    this.data = data;
    this.course.replaceChildren(...[["mass", data.mass, "kg"], ["speed", data.speed, "m/s"]].map(([name, values, unit]) => small(name, data.t, values, unit)));
    this.place();
  }

  // Draws a line at the time of the shown snapshot.
  place() {
    if (!this.data) return;
    const x = across(this.data.t)(this.t);
    for (const line of this.course.querySelectorAll("line")) ["x1", "x2"].forEach((name) => line.setAttribute(name, x));
  }
}

// The time of birth is unknown if parts are separated only by erosion.
const born = (birth) => (birth === 0 ? "at the start" : si(birth, "s"));

function facts(found, part) {
  return [
    entry("fragment", found.rest ? "the rest" : String(found.id)), entry("mass", si(found.mass, "kg")),
    entry("size", si(found.size, "m")), entry("tets", count(found.tets)),
    entry("part", part || "–"), entry("birth", born(found.birth)),
    entry("speed", si(Math.hypot(...found.velocity), "m/s")), entry("velocity", vector([...found.velocity], "m/s"), true),
    entry("centre", vector([...found.centre], "m"), true),
  ];
}

const across = (t) => (time) => (WIDE * (time - t[0])) / (t.at(-1) - t[0] || 1);

function svg(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

// Returns a small chart of a quantity over time from 0 to the largest value, which is written beside the name.
function small(name, t, values, unit) {
  const most = Math.max(...values) || 1;
  const x = across(t);
  const path = values.map((value, i) => `${i ? "L" : "M"}${x(t[i])} ${TALL - (TALL * value) / most}`).join("");
  const [first, last] = alike([values[0], values.at(-1)], unit);
  const drawn = svg("svg", { viewBox: `0 0 ${WIDE} ${TALL}`, role: "img", "aria-label": `${name} over time, from ${first} to ${last}`, preserveAspectRatio: "none" },
    svg("path", { d: path, class: "over-time" }), svg("line", { x1: 0, x2: 0, y1: 0, y2: TALL, class: "now-line" }));
  return h("figure", {}, h("figcaption", {}, `${name}, up to ${si(most, unit)}`), drawn);
}

// Returns the table of the heaviest fragments of a snapshot. `onPick` is called with the table row of the chosen
// fragment.
export function table(snapshot, picked, onPick) {
  const { arrays, header } = snapshot;
  const parts = partsOf(snapshot);
  const { fragment_id: ids, fragment_mass: masses, fragment_size: sizes, fragment_velocity: v, fragment_birth: births } = arrays;
  const rows = [...ids.keys()].filter((row) => ids[row] >= 0n).sort((a, b) => masses[b] - masses[a]).slice(0, HEAVIEST);
  const columns = [
    rows.map((row) => parts[row]), alike(rows.map((row) => masses[row]), "kg"), alike(rows.map((row) => Math.hypot(v[3 * row], v[3 * row + 1], v[3 * row + 2])), "m/s"),
    alike(rows.map((row) => sizes[row]), "m"), rows.map((row) => (births[row] === 0 ? "start" : born(births[row]))),
  ];
  const body = rows.map((row, i) => h("tr", { "aria-selected": String(row === picked) },
    h("th", { scope: "row" }, h("button.tab", { type: "button", onclick: () => onPick(row) }, String(ids[row]))), columns.map((column, k) => h(k ? "td.number" : "td", {}, column[i]))));
  const more = header.fragments_total - rows.length;
  return [
    h("table.checks.heaviest", {}, h("thead", {}, h("tr", {}, ["number", "part", "mass", "speed", "size", "birth"].map((name, i) => h(i > 1 ? "th.number" : "th", { scope: "col" }, name)))), h("tbody", {}, body)),
    more > 0 ? h("p.hint", {}, `and ${count(more)} lighter fragments`) : "",
  ];
}
