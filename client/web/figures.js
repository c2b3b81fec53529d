// Formats of numbers and times as text, and creation of elements. The rules are those of cases/figures.py;
// tests/figures.json has inputs and texts for both modules.

const UP = [[1e12, "T"], [1e9, "G"], [1e6, "M"], [1e3, "k"]];
const DOWN = [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];
// Units that can have any prefix.
const PREFIXED = ["m", "g", "J", "Pa", "N", "W", "B", "Hz", "m/s", "N s", "N m", "J/m^2", "B/s"];
const named = (unit, steps) => steps.map(([factor, prefix]) => [factor, prefix + unit]);
const LADDERS = {
  ...Object.fromEntries(PREFIXED.map((unit) => [unit, named(unit, [...UP, ...DOWN])])),
  s: named("s", DOWN),
  kg: [[1, "kg"], [1e-3, "g"], [1e-6, "mg"], [1e-9, "µg"]],
  "m^2": [[1e-2, "m^2"], [1e-8, "mm^2"], [1e-12, "µm^2"]],
  "m^3": [[1e-3, "m^3"], [1e-12, "mm^3"], [1e-18, "µm^3"]],
};
const WORTH = { "m^2": 1, "mm^2": 1e-6, "µm^2": 1e-12, "m^3": 1, "mm^3": 1e-9, "µm^3": 1e-18 };
// Limits of plain numbers: a number below the first value, or with more digits before the point than the second value,
// is written with a power of ten.
const PLAIN = [1e-3, 5];
const MOST = 1e12; // Integers above this value are written with a power of ten.
const MOST_HOURS = 10000;
export const UNKNOWN = "–";

const known = (value) => (typeof value === "number" ? value : NaN);
const tied = (text, unit) => (text === UNKNOWN ? text : `${text} ${unit}`.trim());

// Returns a number with `digits` significant digits and its unit, with a fitting prefix if the unit can have one.
export const si = (value, unit = "", digits = 3) => alike([value], unit, digits)[0];

// Returns the text of `si` without trailing zeros.
export const exact = (value, unit = "", digits = 6) => trimmed(si(value, unit, digits));

// Returns the texts of a group of values; all have the prefix of the largest magnitude.
export function alike(values, unit = "", digits = 3) {
  const [worth, name] = unitOf(values.map(known), unit, digits);
  return values.map(known).map((value) => (Number.isNaN(value) ? UNKNOWN : tied(significant(value / worth, digits), name)));
}

export const exacts = (values, unit = "", digits = 6) => alike(values, unit, digits).map(trimmed);

// Returns the components of a vector with one unit, such as "1, 200 mm".
export function vector(values, unit = "", digits = 3, between = ", ") {
  const [worth, name] = unitOf(values.map(known), unit, digits);
  return tied(values.map((value) => trimmed(significant(known(value) / worth, digits))).join(between), name);
}

// Returns a function that labels an axis from 0 to `most` with one prefix.
export function onAxis(most, unit) {
  const [worth, name] = unitOf([known(most)], unit, 3);
  return (value) => tied(trimmed(significant(value / worth, 3)), name);
}

// Returns the unit with prefix for an axis or a column whose largest magnitude is `most`, its factor, and functions for
// texts without the unit.
export function scaleOf(most, unit) {
  const [worth, name] = unitOf([known(most)], unit, 3);
  return { worth, unit: name, text: (value) => exact(value / worth) };
}

// Returns a number without a unit; a large number has k, M, G or T.
export function large(value) {
  const [worth, name] = step(Math.abs(known(value)), [...UP, [1, ""]], 3);
  return tied(significant(known(value) / worth, 3), name);
}

function unitOf(values, unit, digits) {
  const most = Math.max(0, ...values.filter(Number.isFinite).map(Math.abs));
  if (!Object.hasOwn(LADDERS, unit) || most === 0) return [1, unit];
  const [factor, name] = step(most, LADDERS[unit], digits);
  return [WORTH[name] ?? factor, name];
}

const step = (most, ladder, digits) => ladder.find(([factor]) => most >= factor * (1 - 0.5 * 10 ** -digits)) ?? ladder.at(-1);

export const number = (value) => exact(value);

// Returns two significant digits and the power of ten, as used for residuals.
export const rough = (value) => (Number.isFinite(value) && value !== 0 ? power(value, 2) : significant(known(value), 2));

export const fixed = (value, decimals = 2) => (Number.isFinite(value) ? rounded(value, decimals) : UNKNOWN);

export function percent(share, decimals = 1) {
  const text = fixed(100 * known(share), decimals);
  return text === UNKNOWN ? text : `${text} %`;
}

// Returns an integer whose thousands are separated by a space that does not break.
export function count(value) {
  if (!Number.isFinite(value)) return UNKNOWN;
  if (Math.abs(value) >= MOST) return power(value, 3);
  return rounded(value, 0).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

export const counted = (value, noun, plural = "") => `${count(value)} ${value === 1 ? noun : plural || `${noun}s`}`;

export const size = (value) => si(value, "B");

function significant(value, digits) {
  if (Number.isNaN(value)) return UNKNOWN;
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "-∞";
  if (value === 0) return "0";
  const text = power(value, digits);
  const at = Number(text.split("e")[1]);
  if (Math.abs(value) < PLAIN[0] || at >= Math.max(PLAIN[1], digits)) return text;
  return rounded(value, Math.max(0, digits - 1 - at));
}

// Rounds to a number of decimals; halves are rounded away from zero.
function rounded(value, decimals) {
  const text = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(text) !== 0 ? `-${text}` : text;
}

const power = (value, digits) => (value < 0 ? "-" : "") + Math.abs(value).toExponential(digits - 1).replace("e+", "e");

// Removes zeros at the end of the decimals.
const trimmed = (text) => text.replace(/(\.\d*?)0+(?=e| |$)/, "$1").replace(/\.(?=e| |$)/, "");

export function duration(seconds) {
  if (!Number.isFinite(seconds) || seconds < 0) return UNKNOWN;
  if (seconds < 9.95) return `${rounded(seconds, 1)} s`;
  if (seconds >= 3600 * MOST_HOURS) return `${significant(seconds / 3600, 3)} h`;
  const whole = Number(rounded(seconds, 0));
  if (whole < 60) return `${whole} s`;
  const two = (part) => String(part).padStart(2, "0");
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${two(whole % 60)} s`;
  return `${Math.floor(whole / 3600)} h ${two(Math.floor((whole % 3600) / 60))} min`;
}

export const clock = (wall) => new Date(1000 * wall).toLocaleTimeString("en-GB");

export function moment(wall) {
  const then = new Date(1000 * wall);
  const today = then.toDateString() === new Date().toDateString();
  const day = then.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" });
  const time = then.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  return today ? `today ${time}` : `${day} ${time}`;
}

const HOUR = new Intl.DateTimeFormat("en-GB", { hour: "2-digit", minute: "2-digit" });
const DAY = new Intl.DateTimeFormat("en-GB", { day: "numeric", month: "short" });
const DATE = new Intl.DateTimeFormat("en-GB", { day: "numeric", month: "short", year: "numeric" });

// Returns a time for a table column; the year is written only if it is not the present year.
export function when(wall) {
  const [then, now] = [new Date(1000 * wall), new Date()];
  const day = then.getFullYear() === now.getFullYear() ? DAY : DATE;
  return `${then.toDateString() === now.toDateString() ? "today" : day.format(then)} ${HOUR.format(then)}`;
}

export const words = (text) => String(text).replaceAll("_", " ");

// h("p.hint#id", { title: "…" }, "text", child, …) creates an element. Text is always set as text, never as markup.
export function h(what, attributes = {}, ...children) {
  const [, tag, rest] = /^([a-z0-9]+)(.*)$/s.exec(what);
  const element = document.createElement(tag);
  for (const [, kind, name] of rest.matchAll(/([.#])([\w-]+)/g)) {
    if (kind === ".") element.classList.add(name);
    else element.id = name;
  }
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "style") Object.assign(element.style, value);
    else if (value !== false && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

export const pill = (state) => h(`span.pill.${state}`, {}, words(state));

export function meter(state, share) {
  const width = `${(100 * Math.min(1, Math.max(0, share))).toFixed(2)}%`;
  const value = Math.round(100 * share);
  return h(`div.meter.${state}`, { role: "progressbar", "aria-label": "progress", "aria-valuenow": value, "aria-valuemin": 0, "aria-valuemax": 100 },
    h("i", { style: { width } }));
}

export const legend = (entries) =>
  h("div.legend", {}, entries.map(([name, colour, value]) =>
    h("span", {}, h("i", { style: { background: `var(--${colour})` } }), name, value ? h("b", {}, value) : null)));
