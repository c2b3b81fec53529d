// Rows of many runs (GET /v1/table), merged page by page. No elements are created here.

const ALIKE = 0.8; // Share of common keys above which the values of two cases are compared; the same as on the server.

export class RunTable {
  constructor() {
    this.rows = new Map(); // By id.
    this.kinds = []; // Groups of similar cases: { keys, units }.
    this.units = new Map(); // Units of results, by name.
    this.pending = 0;
    this.version = 0;
  }

  // Merges one answer; true if anything has changed.
  take({ runs, cases, pending = 0 }) {
    const kinds = cases.map((one) => this.kind(one));
    for (const { results } of cases) for (const { name, unit } of results) if (!this.units.has(name)) this.units.set(name, unit);
    const fresh = runs.filter((run) => this.put(run, cases[run.case], kinds[run.case]));
    this.pending = pending;
    this.version += fresh.length > 0;
    return fresh.length > 0;
  }

  // False for an unchanged row.
  put(run, one, kind) {
    const content = JSON.stringify([run, one?.results.length]);
    if (this.rows.get(run.id)?.content === content) return false;
    const results = new Map((run.results ?? []).map((value, i) => [one.results[i].name, value]));
    this.rows.set(run.id, { ...run, content, kind, base: one?.values ?? {}, results: run.results && results, hay: hay(run) });
    return true;
  }

  // Removes runs that are newer than the last row of a reread page but are not on it.
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

  // Unix time in s of the newest submission or end.
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

// Text that filters search.
const hay = ({ name, title, state, cause, message, labels }) =>
  [name, title, state, cause, message, ...Object.entries(labels).map(([key, value]) => `${key}=${value}`)].join("\n").toLowerCase();

export const valueOf = (row, key) => (key in row.values ? row.values[key] : row.base[key] ?? null);

const NEVER = /^run\.(ranks|threads|profile)$/; // Keys with columns of their own.

const LEAST = 0.1; // Least number of runs that a prominent key sets apart, over that of the first key. Chosen.
const ASIDE = /^(run\.(?!end_time)|balance\.|probes\[|reference\[)/; // Keys that do not change what is computed.

// Keys whose values differ between rows of similar cases; those that set most runs apart first.
export const differing = (rows, most) => ranked(rows).slice(0, most).map(({ key }) => key);

// The keys among `keys` that are shown at first: not those that only few runs have changed, and of keys with the same
// values only one.
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

// { key, apart, courses }: number of runs whose value is not the most frequent one of their kind; the values of each kind
// in which the key differs.
function ranked(rows) {
  const found = new Map();
  [...new Set(rows.map((row) => row.kind))].filter(Boolean).forEach((kind, number) => {
    const own = rows.filter((row) => row.kind === kind);
    const keys = new Set(own.flatMap((row) => Object.keys(row.values)));
    const bases = new Set(own.map(({ base }) => base));
    if (bases.size > 1) for (const base of bases) for (const key of Object.keys(base)) keys.add(key);
    for (const key of keys) {
      const values = own.map((row) => valueOf(row, key));
      const apart = spread(values);
      const known = found.get(key) ?? { apart: 0, courses: [] };
      if (apart) found.set(key, { key, apart: known.apart + apart, courses: [...known.courses, `${number}: ${values.join()}`] });
    }
  });
  return [...found.values()].filter(({ key }) => !NEVER.test(key)).sort((a, b) => b.apart - a.apart);
}

// Number of values apart from the most frequent one.
function spread(values) {
  const number = new Map();
  for (const value of values) number.set(value, (number.get(value) ?? 0) + 1);
  return values.length - Math.max(...number.values());
}

// Shortest unique prefix of each id, of at least `least` characters.
export function shorts(ids, least = 7) {
  const sorted = [...ids].sort();
  const shared = (a = "", b = "") => {
    let n = 0;
    while (n < a.length && a[n] === b[n]) n += 1;
    return n;
  };
  return new Map(sorted.map((id, i) => [id, id.slice(0, Math.max(least, 1 + shared(id, sorted[i - 1]), 1 + shared(id, sorted[i + 1])))]));
}
