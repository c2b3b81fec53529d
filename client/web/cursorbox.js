// Box with the values of all lines of a chart at its cursor, beside the pointer or beside the focused chart.

import { colour } from "./axes.js";
import { exact, h } from "./figures.js";

const AWAY = 14; // Distance of the box from the pointer, px.
const MOST = 24; // Largest number of text lines in the box.

// Returns the index of the point in `data` nearest to x; the points are sorted by x.
export function nearestTo(data, x) {
  let [low, high] = [0, data.length - 1];
  const at = (i) => (data[i].value ?? data[i])[0];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (at(middle) <= x) low = middle;
    else high = middle;
  }
  return Math.abs(at(high) - x) < Math.abs(at(low) - x) ? high : low;
}

// Returns [{ name, value, colour, dash, text }] of the series at x, the largest value first. Stacked series are sorted
// from the top of the stack.
export function worth(list, x) {
  const known = list.filter(({ data, aside, tooltip }) => data?.length && !aside && tooltip);
  const entries = known.flatMap(({ name, data, color, lineStyle, tooltip: { valueFormatter }, stack }) => {
    const point = data[nearestTo(data, x)];
    const [, value] = point.value ?? point;
    return Number.isFinite(value) ? [{ name, value, color, dash: lineStyle?.type, stack, text: valueFormatter(value, point) }] : [];
  });
  return entries.some(({ stack }) => stack) ? entries.reverse() : entries.sort((a, b) => b.value - a.value);
}

// The page has one box, which the chart with the pointer or the focus uses.
class Readout {
  get element() {
    if (!this.made) document.body.append(this.made = h("div.readout", { role: "status", hidden: "" }));
    return this.made;
  }

  // Shows the box for the chart `of` at the point `place`, [x, y] in the window.
  show(of, x, list, place) {
    const rows = worth(list, x);
    if (!rows.length) return this.hide(of);
    this.of = of;
    this.element.hidden = false;
    this.element.replaceChildren(h("b", {}, exact(x, of.unit ?? "s", 4)), h("div.rows", {}, rows.slice(0, MOST).flatMap(({ name, color, dash, text }) =>
      [h(`i.swatch.dash-${Array.isArray(dash) ? dash[0] : "none"}`, { style: { color: color ?? colour("ink") } }), h("span", {}, name), h("span.number", {}, text)])),
    rows.length > MOST ? `and ${rows.length - MOST} more` : "");
    const { offsetWidth: width, offsetHeight: height } = this.element;
    const left = place[0] + AWAY + width < innerWidth ? place[0] + AWAY : Math.max(0, place[0] - AWAY - width);
    Object.assign(this.element.style, { left: `${left}px`, top: `${Math.max(4, Math.min(innerHeight - height - 4, place[1] - height / 2))}px` });
  }

  hide(of) {
    if (this.of !== of) return;
    this.of = null;
    this.element.hidden = true;
  }
}

export const readout = new Readout();
