// Values that this browser stores for the next visit. Without storage (a private window, no space) the values last as
// long as the page.

import { h } from "./figures.js";

const here = new Map();

// Returns a stored value. A value of another type than `otherwise`, which another version of the page may have stored,
// counts as missing.
export function recall(key, otherwise) {
  const there = stored(key) ?? here.get(key);
  return there !== undefined && alike(there, otherwise) ? there : otherwise;
}

function stored(key) {
  try {
    return JSON.parse(localStorage.getItem(`conoid.${key}`)) ?? undefined;
  } catch {
    return undefined;
  }
}

// Returns true if a stored value has the type of an example. Objects are compared field by field, a list must contain
// only texts, and the example null accepts any type.
function alike(value, example) {
  if (example === null || example === undefined) return true;
  if (Array.isArray(example)) return Array.isArray(value) && value.every((one) => typeof one === "string");
  if (typeof example !== "object") return typeof value === typeof example;
  return typeof value === "object" && !Array.isArray(value) && Object.entries(example).every(([name, one]) => alike(value[name], one));
}

export function remember(key, value) {
  here.set(key, value);
  try {
    localStorage.setItem(`conoid.${key}`, JSON.stringify(value));
  } catch {
    // Without storage the value lasts as long as the page.
  }
}

// Returns a section that opens and closes by its title; whether it is open is stored.
export function fold(key, open, title, ...content) {
  const element = h("details.fold", { open: recall(`fold.${key}`, open) ? "" : false, ontoggle: () => remember(`fold.${key}`, element.open) },
    h("summary", {}, title), ...content);
  return element;
}
