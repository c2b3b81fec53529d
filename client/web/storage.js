// What this browser keeps for the next visit. Where it keeps nothing (a private window, a full store) the page goes
// without: values last as long as the page.

import { h } from "./figures.js";

const here = new Map();

// A value of another kind than `otherwise`, which another version of the page may have left, counts as none.
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

// Whether a value has the kind of an example, an object the kinds of its fields, a list texts alone; all are like none.
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
    // It lasts as long as the page.
  }
}

// A part of the page that opens and closes at its title, and is the next time as it was left.
export function fold(key, open, title, ...content) {
  const element = h("details.fold", { open: recall(`fold.${key}`, open) ? "" : false, ontoggle: () => remember(`fold.${key}`, element.open) },
    h("summary", {}, title), ...content);
  return element;
}
