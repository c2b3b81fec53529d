// Sorting, filters and groups of the rows of a table. The module creates no HTML elements.

const collator = new Intl.Collator("en", { numeric: true });

// Returns rows sorted by a column. Missing values are last in both directions, preceded by `unsure` values; equal
// values are sorted by age, newest first.
export function sorted(rows, column, down) {
  const sign = down ? -1 : 1;
  const keyed = rows.map((row) => [column.value(row), row, column.unsure?.(row) ?? false]);
  const none = (value) => value === null || value === undefined || value === "" || Number.isNaN(value);
  const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b : collator.compare(String(a), String(b)));
  keyed.sort(([a, one, early], [b, other, soon]) => (none(a) || none(b) ? none(a) - none(b) : early - soon || sign * compare(a, b)) || (one.id < other.id ? 1 : -1));
  return keyed.map(([, row]) => row);
}

const COMPARED = /^(.+?)(<=|>=|<|>|=)(-?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)$/i;
const NEAR = 1e-9; // Relative tolerance for the comparison of a number that is written in another unit.
const HOLDS = { "<": (way) => way < 0, ">": (way) => way > 0, "<=": (way) => way <= 0, ">=": (way) => way >= 0, "=": (way) => way === 0 };

// Returns a test of rows for words that must all match. A word is text anywhere in a row, the beginning of an id,
// state:failed, case:bar, or a comparison of a column in its unit, such as speed_end>12.
export function matcher(text, columns) {
  const tests = text.trim().split(/\s+/).filter(Boolean).map((word) => tested(word.toLowerCase(), columns));
  return (row) => tests.every((test) => test(row));
}

// Returns the ids of the columns whose numbers a filter compares.
export function compared(text, columns) {
  const names = text.trim().toLowerCase().split(/\s+/).map((word) => COMPARED.exec(word)?.[1]).filter(Boolean);
  return new Set(names.map((name) => named(columns, name)?.id));
}

function tested(word, columns) {
  const [, name, sign, number] = COMPARED.exec(word) ?? [];
  const column = name && named(columns, name);
  if (column) {
    return (row) => {
      const value = column.value(row);
      const apart = value / (column.worth ?? 1) - Number(number);
      return typeof value === "number" && HOLDS[sign](Math.abs(apart) <= NEAR * Math.abs(number) ? 0 : Math.sign(apart));
    };
  }
  const [, field, rest] = /^(state|case):(.+)$/.exec(word) ?? [];
  if (field === "state") return (row) => row.state.startsWith(rest);
  if (field === "case") return (row) => row.name.toLowerCase().includes(rest);
  return (row) => row.hay.includes(word) || row.id.startsWith(word);
}

const named = (columns, name) => {
  const numbers = columns.filter(({ number }) => number);
  const by = (test) => numbers.find(({ title, full = "" }) => [title, title.replaceAll(" ", "_"), full].some((one) => test(one.toLowerCase())));
  return by((title) => title === name) ?? by((title) => title.includes(name));
};

// Returns { key, rows } for each group, in the order of its first row. Runs without a sweep have the key "" and come
// last.
export function grouped(rows, by) {
  const groups = new Map();
  for (const row of rows) {
    const key = by === "sweep" ? row.labels.sweep ?? "" : row.name;
    if (!groups.has(key)) groups.set(key, { key, rows: [] });
    groups.get(key).rows.push(row);
  }
  return [...groups.values()].sort((a, b) => (a.key === "") - (b.key === ""));
}
