// Files that the page makes: tables as CSV in SI units, pictures as SVG.

import { h } from "./figures.js";

// Saves a text as a file.
export function save(name, text, type) {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = h("a", { href: url, download: name.replace(/[^\w.-]+/g, "_") });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

const cell = (value) => {
  if (value === null || value === undefined || Number.isNaN(value)) return "";
  const text = String(value);
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
};

export const toCsv = (head, rows) => [head, ...rows].map((row) => row.map(cell).join(",")).join("\n").concat("\n");

// Returns the drawn data as a table with x and a column for each series. Series with equal x share rows; a missing
// value is an empty cell.
export function tableOf({ series, xName = "t [s]" }) {
  const drawn = series.filter(({ data, aside }) => data?.length && !aside);
  const rows = new Map();
  drawn.forEach(({ data }, at) => data.forEach((point) => {
    const [x, y] = point.value ?? point;
    if (!rows.has(x)) rows.set(x, [x, ...Array(drawn.length).fill(null)]);
    rows.get(x)[at + 1] = y;
  }));
  const head = [xName, ...drawn.map(({ name, unit }) => (unit ? `${name} [${unit}]` : name))];
  return { head, rows: [...rows.values()].sort((a, b) => a[0] - b[0]) };
}

// Returns all rows of a history.csv with t and the named columns, even if a chart draws fewer points.
export function pick(text, names) {
  const [head, ...lines] = text.split(/\r?\n/).filter(Boolean);
  const columns = head.split(",");
  const places = ["t", ...names].map((name) => columns.findIndex((column) => column === name || column.startsWith(`${name} [`))).filter((place) => place >= 0);
  const rows = lines.map((line) => split(line)).filter((cells) => cells.length === columns.length);
  return { head: places.map((place) => columns[place]), rows: rows.map((cells) => places.map((place) => cells[place])) };
}

// Returns the cells of a CSV line; a cell with a comma is quoted.
const split = (line) => (line.includes('"') ? [...line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/g)].map(([, quoted, plain]) => quoted?.replaceAll('""', '"') ?? plain) : line.split(","));
