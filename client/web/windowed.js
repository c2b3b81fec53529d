// Table with many rows of equal height, of which only the visible rows have elements.

import { h } from "./figures.js";

// Number of rows with elements above and below the visible rows, so that the Tab key can continue there.
const MORE = 8;

export class Windowed {
  // `make(item, n)` returns the row element of an item; it is called again when `item` or `version` has changed.
  // `region`: the scrolling element; `tall()`: height of a row, px.
  constructor(region, make, tall) {
    Object.assign(this, { region, make, tall, items: [], version: 0, made: new Map() });
    this.above = h("tr.space", { "aria-hidden": "true" });
    this.below = h("tr.space", { "aria-hidden": "true" });
    this.body = h("tbody");
    region.addEventListener("scroll", () => this.draw(), { passive: true });
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(region);
  }

  close() { this.watch.disconnect(); }

  // Sets the items of the table. Each item has a unique `key`, and a `content` that changes with what the row shows.
  set(items, version) {
    Object.assign(this, { items, version });
    this.draw();
  }

  // Makes all visible rows again.
  again() {
    this.made = new Map();
    this.draw();
  }

  draw() {
    const tall = this.tall();
    const seen = Math.ceil((this.region.clientHeight || 600) / tall);
    const first = Math.max(0, Math.min(this.items.length - seen, Math.floor((this.region.scrollTop || 0) / tall)) - MORE);
    const last = Math.min(this.items.length, first + seen + 2 * MORE);
    const focus = this.focused();
    const before = this.made;
    this.made = new Map();
    const rows = [];
    for (let n = first; n < last; n += 1) rows.push(this.row(this.items[n], n, before));
    this.above.style.height = `${first * tall}px`;
    this.below.style.height = `${(this.items.length - last) * tall}px`;
    put(this.body, [this.above, ...rows, this.below]);
    focus?.();
  }

  row(item, n, before) {
    const stamp = `${this.version} ${item.content}`;
    const known = before.get(item.key);
    const element = known?.stamp === stamp ? known.element : this.make(item, n);
    element.setAttribute("aria-rowindex", n + 2);
    this.made.set(item.key, { stamp, element });
    return element;
  }

  // Gives the focus back to a row that is made again.
  focused() {
    const active = document.activeElement;
    const found = active && this.body.contains?.(active) && [...this.made].find(([, { element }]) => element.contains(active));
    if (!found) return null;
    const place = [...found[1].element.querySelectorAll("a, button, input")].indexOf(active);
    return () => {
      if (this.body.contains(active)) return;
      this.made.get(found[0])?.element.querySelectorAll("a, button, input")[place]?.focus({ preventScroll: true });
    };
  }
}

// Sets the children of an element in order; existing children are not moved.
function put(place, elements) {
  const wanted = new Set(elements);
  for (const child of [...place.children]) if (!wanted.has(child)) child.remove();
  elements.forEach((element, i) => { if (place.children[i] !== element) place.insertBefore(element, place.children[i] ?? null); });
}
