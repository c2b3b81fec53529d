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

// Keys whose values differ between rows of similar cases; those of most rows first.
export function differing(rows, most) {
  const found = new Map();
  for (const kind of new Set(rows.map((row) => row.kind))) {
    const own = rows.filter((row) => row.kind === kind && kind);
    const keys = new Set(own.flatMap((row) => Object.keys(row.values)));
    const bases = new Set(own.map(({ base }) => base));
    if (bases.size > 1) for (const base of bases) for (const key of Object.keys(base)) keys.add(key);
    for (const key of keys) {
      const first = valueOf(own[0], key);
      if (own.some((row) => valueOf(row, key) !== first)) found.set(key, (found.get(key) ?? 0) + own.length);
    }
  }
  return [...found].filter(([key]) => !NEVER.test(key)).sort((a, b) => b[1] - a[1]).slice(0, most).map(([key]) => key);
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
