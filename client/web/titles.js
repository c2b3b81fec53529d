// Titles of columns for keys of cases, such as "ball velocity z" for "parts[0].velocity[2]". The module creates no
// elements.

import { words } from "./figures.js";

// Names of tables that titles leave out.
const LEFT_OUT = new Set(["parts", "run", "boundaries", "materials", "numerics", "mesh"]);
const AXES = ["x", "y", "z"];
const MEMBER = { parts: "part", boundaries: "boundary", probes: "probe" };

// Returns a map of keys to titles. If several keys would have the same title, each key is its own title.
export function titles(keys, rows) {
  const bases = [...new Set(rows.map(({ base }) => base))];
  const found = new Map(keys.map((key) => [key, titled(key, bases)]));
  const number = new Map();
  for (const title of found.values()) number.set(title, (number.get(title) ?? 0) + 1);
  return new Map([...found].map(([key, title]) => [key, number.get(title) > 1 ? key : title]));
}

function titled(key, bases) {
  const there = bases.filter((base) => key in base);
  const parts = key.split(".");
  const found = parts.map((part, i) => {
    const [, name, place] = /^(.*?)(?:\[(\d+)\])?$/.exec(part);
    if (place !== undefined) return member(parts.slice(0, i).concat(name).join("."), name, Number(place), there);
    return LEFT_OUT.has(name) && i < parts.length - 1 ? "" : name;
  });
  return words(found.filter(Boolean).join(" "));
}

// Returns the title of a member of a list: an axis for a vector, the name that all cases give to the member, or its
// number from 1.
function member(list, name, place, bases) {
  const vector = bases.length > 0 && bases.every((base) => `${list}[2]` in base && !(`${list}[3]` in base));
  if (vector && place < AXES.length) return `${name} ${AXES[place]}`;
  const names = new Set(bases.map((base) => base[`${list}[${place}].name`]));
  const [own] = names;
  return names.size === 1 && own ? own : `${MEMBER[name] ?? name} ${place + 1}`;
}
