// What this browser keeps for the next visit. Where it keeps nothing (a private window, a full store) the page goes
// without: values last as long as the page.

import { h } from "./figures.js";

const here = new Map();

export function recall(key, otherwise) {
  try {
    const text = localStorage.getItem(`conoid.${key}`);
    return text === null ? here.get(key) ?? otherwise : JSON.parse(text);
  } catch {
    return here.get(key) ?? otherwise;
  }
}

export function remember(key, value) {
  here.set(key, value);
  try {
    localStorage.setItem(`conoid.${key}`, JSON.stringify(value));
  } catch {
    // It lasts as long as the page.
  }
}

// A part of the page that opens and closes at its title, and is the next time as it was left.
export function fold(key, open, title, ...content) {
  const element = h("details.fold", { open: recall(`fold.${key}`, open) ? "" : false, ontoggle: () => remember(`fold.${key}`, element.open) },
    h("summary", {}, title), ...content);
  return element;
}
