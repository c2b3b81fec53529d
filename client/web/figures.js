// Numbers and times as people read them, and the making of elements.

const PREFIXES = [[1e12, "T"], [1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"], [1e-12, "p"]];

export function si(value, unit = "", digits = 3) {
  if (value === undefined || value === null || !Number.isFinite(value)) return "–";
  if (value === 0) return `0 ${unit}`.trim();
  const [factor, prefix] = PREFIXES.find(([size]) => Math.abs(value) >= 0.9995 * size) ?? PREFIXES.at(-1);
  const scaled = value / factor;
  const before = Math.max(1, Math.floor(Math.log10(Math.abs(scaled)) + 1e-3) + 1);
  return `${scaled.toFixed(Math.max(0, digits - before))} ${prefix}${unit}`.trim();
}

export const count = (value) => (value === undefined ? "–" : Math.round(value).toLocaleString("en").replaceAll(",", "\u202f"));

export function duration(seconds) {
  if (seconds === undefined || !Number.isFinite(seconds) || seconds < 0) return "–";
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  if (whole < 60) return `${whole} s`;
  const two = (number) => String(number).padStart(2, "0");
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

export const percent = (share) => `${(100 * share).toFixed(1)} %`;

export const words = (text) => String(text).replaceAll("_", " ");

// h("p.hint#id", { title: "…" }, "text", child, …): text is always set as text, never as markup.
export function h(what, attributes = {}, ...children) {
  const [, tag, rest] = /^([a-z0-9]+)(.*)$/.exec(what);
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
