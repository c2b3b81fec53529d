// Rows of many runs (GET /v1/table), merged page by page. The module creates no HTML elements.

// Fraction of common keys above which two cases are similar, so that their values are compared; the server has the same
// number.
const ALIKE = 0.8;

export class RunTable {
  constructor() {
    this.rows = new Map(); // Rows by the id of the run.
    this.kinds = []; // Groups of similar cases: { keys, units }.
    this.units = new Map(); // Units of results, by name.
    this.pending = 0;
    this.version = 0;
  }

  // Merges an answer of the server; returns true if anything has changed.
  take({ runs, cases, pending = 0 }) {
    const kinds = cases.map((one) => this.kind(one));
    for (const { results } of cases) for (const { name, unit } of results) if (!this.units.has(name)) this.units.set(name, unit);
    const fresh = runs.filter((run) => this.put(run, cases[run.case], kinds[run.case]));
    this.pending = pending;
    this.version += fresh.length > 0;
    return fresh.length > 0;
  }

  // Stores a row; returns false if the row has not changed.
  put(run, one, kind) {
    const content = JSON.stringify([run, one?.results.length]);
    if (this.rows.get(run.id)?.content === content) return false;
    const results = new Map((run.results ?? []).map((value, i) => [one.results[i].name, value]));
    this.rows.set(run.id, { ...run, content, kind, base: one?.values ?? {}, results: run.results && results, hay: hay(run) });
    return true;
  }

  // Removes runs that should be on a page that was read again, because they are newer than its last row, but are not on
  // it.
  keepOnly(runs, whole) {
    const last = whole ? "" : runs.at(-1)?.id ?? "";
    const there = new Set(runs.map(({ id }) => id));
    for (const id of [...this.rows.keys()]) {
      if (id >= last && !there.has(id)) {
        this.rows.delete(id);
        this.version += 1;
      }
    }
  }

  kind({ values, units }) {
    const keys = Object.keys(values);
    const found = this.kinds.find((kind) => alike(kind.keys, keys));
    if (!found) this.kinds.push({ keys: new Set(keys), units: { ...units } });
    else Object.assign(found.units, units);
    return found ?? this.kinds.at(-1);
  }

  // Returns the Unix time in s of the newest submission or end of a run.
  get latest() {
    let latest = 0;
    for (const { submitted, finished } of this.rows.values()) latest = Math.max(latest, submitted, finished ?? 0);
    return latest;
  }
}

function alike(known, keys) {
  const both = keys.filter((key) => known.has(key)).length;
  return both >= ALIKE * (known.size + keys.length - both);
}

// Returns the text of a row in which filters search.
const hay = ({ name, title, state, cause, message, labels }) =>
  [name, title, state, cause, message, ...Object.entries(labels).map(([key, value]) => `${key}=${value}`)].join("\n").toLowerCase();

export const valueOf = (row, key) => (key in row.values ? row.values[key] : row.base[key] ?? null);

const NEVER = /^run\.(ranks|threads|profile)$/; // Keys that have columns of their own.
const MATERIAL = /^materials\./; // Constants of a material; a case has those of its own materials only.

// Smallest number of runs that a prominent key distinguishes, relative to the number for the first key. Chosen value.
const LEAST = 0.1;
const ASIDE = /^(run\.(?!end_time)|balance\.|probes\[|reference\[)/; // Keys that do not change the answer of a run.

// Returns the keys whose values differ between rows of similar cases; keys that distinguish most runs come first.
export const differing = (rows, most) => ranked(rows).slice(0, most).map(({ key }) => key);

// Returns those of the `keys` that are shown at first. Keys that only few runs have changed are left out; of several
// keys with the same values only one is returned.
export function prominent(rows, keys) {
  const known = ranked(rows).filter(({ key }) => keys.includes(key));
  const main = known.filter(({ key }) => !ASIDE.test(key));
  const list = main.length ? main : known;
  const least = LEAST * Math.max(0, ...list.map(({ apart }) => apart));
  const seen = new Set();
  const fresh = ({ courses }) => {
    const found = courses.some((course) => !seen.has(course));
    for (const course of courses) seen.add(course);
    return found;
  };
  return new Set(list.filter((one) => one.apart >= least && fresh(one)).map(({ key }) => key));
}

// Returns { key, apart, courses }. `apart`: number of runs whose value is not the most frequent value of their kind.
// `courses`: the values in each kind in which the key differs.
function ranked(rows) {
  const found = new Map();
  [...new Set(rows.map((row) => row.kind))].filter(Boolean).forEach((kind, number) => {
    const own = rows.filter((row) => row.kind === kind);
    const keys = new Set(own.flatMap((row) => Object.keys(row.values)));
    const bases = new Set(own.map(({ base }) => base));
    if (bases.size > 1) for (const base of bases) for (const key of Object.keys(base)) keys.add(key);
    for (const key of keys) {
      const values = own.map((row) => valueOf(row, key));
      // The key `material` of a part shows which material a case has; the constants of the material do not differ.
      if (MATERIAL.test(key) && values.includes(null)) continue;
      const apart = spread(values);
      const known = found.get(key) ?? { apart: 0, courses: [] };
      if (apart) found.set(key, { key, apart: known.apart + apart, courses: [...known.courses, `${number}: ${values.join()}`] });
    }
  });
  return [...found.values()].filter(({ key }) => !NEVER.test(key)).sort((a, b) => b.apart - a.apart);
}

// Returns the number of values that are not the most frequent value.
function spread(values) {
  const number = new Map();
  for (const value of values) number.set(value, (number.get(value) ?? 0) + 1);
  return values.length - Math.max(...number.values());
}

// Returns the shortest unique prefix of each id, with at least `least` characters.
export function shorts(ids, least = 7) {
  const sorted = [...ids].sort();
  const shared = (a = "", b = "") => {
    let n = 0;
    while (n < a.length && a[n] === b[n]) n += 1;
    return n;
  };
  return new Map(sorted.map((id, i) => [id, id.slice(0, Math.max(least, 1 + shared(id, sorted[i - 1]), 1 + shared(id, sorted[i + 1])))]));
}
