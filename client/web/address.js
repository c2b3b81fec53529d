// What an address shows: `#/` the runs, `#/runs/ID` one, `#/compare/ID/ID/…` several, `#/sweeps/NAME` a sweep, `#/new` a
// new run; behind a `?` there may be more.

// What stands in an address as text; null for what cannot be read.
function decoded(word) {
  try {
    return decodeURIComponent(word);
  } catch {
    return null;
  }
}

// How many names each page has, at least and at most.
const NAMES = { runs: [0, 1], compare: [2, Infinity], sweeps: [1, 1], new: [0, 0] };

// { page, names, query }: "runs", "run", "compare", "sweep" or "new", and which; an address that cannot be read is that
// of the runs.
export function place(hash) {
  const [path, search = ""] = hash.replace(/^#\/?/, "").split("?", 2);
  const [page, ...words] = path.split("/").filter((word) => word !== "");
  const names = words.map(decoded);
  const [least, most] = Object.hasOwn(NAMES, page) ? NAMES[page] : [0, -1];
  const known = names.length >= least && names.length <= most && !names.includes(null);
  const shown = known ? { runs: names.length ? "run" : "runs", sweeps: "sweep" }[page] ?? page : "runs";
  return { page: shown, names: known ? names : [], query: new URLSearchParams(search) };
}

const WORDS = { run: "runs", sweep: "sweeps", compare: "compare" };

// The address of a page and its names.
export const addressOf = (page, names) => `#/${[WORDS[page], ...names.map(encodeURIComponent)].join("/")}`;
