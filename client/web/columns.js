// Columns of the tables of runs: each column shows one value of a run, with its unit.

import { count, duration, exact, percent, scaleOf, si, UNKNOWN, when } from "./figures.js";
import { FINAL } from "./live.js";
import { differing, prominent, valueOf } from "./runtable.js";
import { sorted } from "./sorting.js";
import { titles } from "./titles.js";

const STATES = ["running", "stopping", "starting", "queued", "accepted", "succeeded", "cancelled", "timed_out", "failed", "lost"];
const ID = 9; // Number of characters of a short id beside the name of a run.
// Largest number of characters of the detail beside a state: in a full table, and in a table with free space.
const [NOTE, LONG] = [10, 60];

export const share = (row) => (row.state === "succeeded" ? 1 : row.progress?.end_time > 0 ? row.progress.t / row.progress.end_time : 0);
export const cores = ({ ranks, threads }) => (threads > 1 ? `${ranks}×${threads}` : String(ranks));
export const took = (row) => (row.started && FINAL.has(row.state) ? row.finished - row.started : null);

// A column is { id, title, group, number, value(row), text(row) }. Rows are sorted by `value`, which is null for a
// missing value. Columns with a smaller `rank` stay in a narrow window. `letters(row)` is the width of a cell whose
// width differs from its text, `most(row)` its width with free space. Columns with `number` are aligned to the right,
// and may have a `unit`, in which `write(value)` formats a number.
const FIRST = [
  { id: "run", title: "run", value: (row) => row.name, text: (row) => row.name, letters: ({ name }) => name.length + ID },
  { id: "state", title: "state", value: (row) => STATES.indexOf(row.state) - share(row), text: (row) => row.state, letters: (row) => letters(row, NOTE), most: (row) => letters(row, LONG) },
];
const LAST = [
  { id: "references", title: "references", value: (row) => (row.references ? row.missed.length : null), text: references },
  { id: "labels", title: "labels", value: labels, text: labels },
  { id: "submitted", title: "submitted", value: (row) => row.submitted, text: (row) => when(row.submitted), rank: -1 },
  { id: "took", title: "took", value: took, text: (row) => (took(row) === null ? "" : duration(took(row))), number: true },
  { id: "cores", title: "cores", full: "ranks × threads", value: (row) => row.ranks * row.threads, text: cores, number: true },
  { id: "cost", title: "CPU time", value: (row) => row.results?.get("cpu") ?? null, text: (row) => duration(row.results?.get("cpu") ?? NaN).replace(UNKNOWN, ""), number: true },
  { id: "title", title: "title", value: (row) => row.title, text: (row) => row.title, shown: false },
  { id: "message", title: "message", value: (row) => row.message || null, text: (row) => row.message, shown: false },
];
const IF_ANY = new Set(["references", "labels"]); // Columns that are shown only if at least one row has a value.
// True for a run that did not succeed, whose results belong to a time before its end.
const unsure = ({ state }) => state !== "succeeded";
const TELLING = /^(fragments|reference\.penetration.*)$/; // Results whose columns are shown by default.
const MOST_PROBES = 4; // Largest number of probes whose columns are shown by default.
const RANGES = 3; // Largest number of keys in the title of a group.
const WORDS = 4; // Largest number of values of a key of words in the title of a group.
const HASH = /\.sha256$/; // Keys whose value is a hash, of which a column shows the first DIGITS digits.
const DIGITS = 8;
const MOST_VALUES = 6; // Largest number of keys of the case whose columns are shown by default.

function labels(row) {
  const own = Object.entries(row.labels).filter(([name]) => name !== "sweep" && name !== "point");
  return own.map(([name, value]) => `${name}=${value}`).join(" ");
}

// Returns the detail of the state of a run: progress, reason of waiting, or cause of the end.
export function detail(row) {
  const note = FINAL.has(row.state) || !row.progress ? (row.state === "succeeded" ? "" : row.message || row.reason || row.cause || "") : percent(share(row), 0);
  return note.startsWith(row.state) ? "" : note;
}

// Returns the number of characters for the state and at most `most` characters of its detail; a progress bar is as wide
// as seven characters.
function letters(row, most) {
  const note = Math.min(most, detail(row).length);
  return 0.9 * row.state.length + 4 + 0.9 * (note && 2 + note) + (row.progress && !FINAL.has(row.state) ? 7 : 0);
}

function references(row) {
  if (!row.references) return "";
  return row.missed.length ? `${row.missed.length} of ${row.references} missed` : `${row.references} pass`;
}

// Returns all columns for some rows. `keys`: keys of cases that differ between rows; `units`: units of results by name.
export function columnsOf(rows, keys, units) {
  const called = titles(keys, rows);
  const first = [...prominent(rows, keys)].slice(0, MOST_VALUES);
  const values = keys.map((key) => numeric(rows, {
    id: `value:${key}`, title: called.get(key), full: key, group: "values that differ", shown: first.includes(key), rank: first.indexOf(key), value: (row) => valueOf(row, key), unit: rows.find((row) => row.kind?.units[key])?.kind.units[key] ?? "", exact: true,
  }));
  const number = new Map([...units.keys()].map((name) => [name, rows.filter((row) => (row.results?.get(name) ?? null) !== null).length]));
  const names = [...units.keys()].filter((name) => name !== "cpu" && number.get(name)).sort((a, b) => number.get(b) - number.get(a));
  const probes = names.filter((name) => /^probe\.[^.]*$/.test(name)).slice(0, MOST_PROBES);
  const telling = (name) => probes.includes(name) || TELLING.test(name);
  names.sort((a, b) => telling(b) - telling(a));
  const results = names.map((name, n) => numeric(rows, {
    id: `result:${name}`, title: titled(name), group: "results", full: name, unit: units.get(name),
    shown: telling(name), rank: n,
    value: (row) => row.results?.get(name) ?? null, unsure,
  }));
  const facts = (list) => list.map((one) => ({ group: "run", rank: MOST_VALUES, shown: !IF_ANY.has(one.id) || rows.some((row) => one.text(row)), ...one }));
  return [...facts(FIRST), ...values, ...results, ...facts(LAST)];
}

const titled = (name) => name.replace(/worst_residual/, "worst energy residual").replace(/^first_break$/, "first broken facet").replace(/^probe\./, "").replace(/^reference\.(.*)$/, "$1, reference").replace(/\.(min|max)$/, " $1");

// Returns a column of numbers in the unit that fits most of them; words stay unchanged.
function numeric(rows, column) {
  const { unit, value } = column;
  const values = rows.map(value).filter((one) => one !== null);
  if (values.some((one) => typeof one !== "number")) {
    const most = HASH.test(column.full) ? DIGITS : Infinity;
    return { ...column, unit: "", text: (row) => String(value(row) ?? "").slice(0, most) };
  }
  const sizes = values.filter((one) => Number.isFinite(one) && one !== 0).map(Math.abs).sort((a, b) => a - b);
  const { worth, unit: name } = scaleOf(sizes[Math.floor(sizes.length / 2)] ?? 0, unit);
  const measured = (one) => (!unit && Number.isInteger(one) ? count(one) : si(one / worth, "", 4));
  const text = (one) => (one === null ? "" : column.exact ? exact(one / worth) : measured(one));
  return { ...column, number: values.length > 0, worth, base: unit, unit: name, write: text, text: (row) => text(value(row)) };
}

// Returns a text with the changed keys of a group, such as "velocity[2] 60 to 300 m/s".
export function ranges(rows, columns) {
  return differing(rows, RANGES).map((key) => columns.find(({ id }) => id === `value:${key}`)).filter(Boolean).map((column) => {
    const there = sorted(rows.filter((row) => column.value(row) !== null), column, false);
    const words = [...new Set(there.map(column.text))];
    if (!column.number) return `${column.title} ${words.slice(0, WORDS).join(" | ")}${words.length > WORDS ? " …" : ""}`;
    return `${column.title} ${words[0]} to ${words.at(-1)} ${column.unit ?? ""}`.trim();
  }).join(", ");
}
