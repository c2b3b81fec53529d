// The charts below the body: a grid of cards that can be closed, and one card beside the body. The browser stores which
// cards are closed and which card is beside the body.

import { h } from "./figures.js";
import { recall, remember } from "./storage.js";

export class Cards {
  // `first` is the name of the card that is beside the body by default.
  constructor(first) {
    Object.assign(this, { first, cards: new Map() });
    this.grid = h("div.cards.charts");
    this.beside = h("div.beside");
    this.shelf = h("div.shelf", { role: "group", "aria-label": "closed charts", hidden: "" });
  }

  get closed() { return recall("cards.closed", []); }

  // Name of the card beside the body; "" if there is no such card.
  get chosen() {
    const name = recall("cards.beside", this.first);
    return this.cards.has(name) && !this.closed.includes(name) ? name : "";
  }

  // Adds a card with its title, an element beside the title, and its content. `name` identifies the card in the
  // browser's storage.
  add(name, title, beside, ...content) {
    const words = typeof title === "string" ? title : title.textContent;
    const tool = (what, tip, act) => h(`button.tool.${what}`, { type: "button", title: tip, "aria-label": `${tip}: ${words}`, onclick: act });
    const move = tool("move", "move beside the body, or back to the grid", () => this.move(name));
    const close = tool("shut", "close", () => this.close(name));
    const element = h("section.card", { "data-card": name, tabindex: -1, "aria-label": words },
      h("div.card-head", {}, h("h2", {}, title), beside, h("span.tools", {}, move, close)), ...content);
    this.cards.set(name, { element, move, words, there: true });
    return element;
  }

  // Shows a card if it has content, else hides it.
  show(name, there) {
    const card = this.cards.get(name);
    if (card.there === there) return;
    card.there = there;
    this.place();
  }

  close(name) {
    remember("cards.closed", [...this.closed.filter((one) => one !== name), name]);
    this.place();
    this.shelf.querySelector(`[data-opens="${CSS.escape(name)}"]`)?.focus();
  }

  open(name) {
    remember("cards.closed", this.closed.filter((one) => one !== name));
    this.place();
    const { element } = this.cards.get(name);
    element.focus({ preventScroll: true });
    element.scrollIntoView?.({ block: "nearest" });
  }

  move(name) {
    remember("cards.beside", this.chosen === name ? "" : name);
    this.place();
    this.cards.get(name).move.focus();
  }

  // Moves every card to its place in the grid or beside the body. Cards at their place are not touched, because a moved
  // element loses focus and canvas.
  place() {
    const { closed, chosen } = this;
    const open = [...this.cards].filter(([name, { there }]) => there && !closed.includes(name));
    put(this.beside, open.filter(([name]) => name === chosen).map(([, { element }]) => element));
    put(this.grid, open.filter(([name]) => name !== chosen).map(([, { element }]) => element));
    const shut = [...this.cards].filter(([name, { there }]) => there && closed.includes(name));
    this.shelf.hidden = !shut.length;
    this.shelf.replaceChildren(h("span", {}, "Closed"), ...shut.map(([name, { words }]) =>
      h("button.quiet", { type: "button", "data-opens": name, onclick: () => this.open(name) }, `+ ${words}`)));
    for (const [name, { move }] of this.cards) move.setAttribute("aria-pressed", String(name === chosen));
  }
}

function put(place, elements) {
  for (const child of [...place.children]) if (!elements.includes(child)) child.remove();
  elements.forEach((element, i) => { if (place.children[i] !== element) place.insertBefore(element, place.children[i] ?? null); });
}
