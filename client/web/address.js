// Addresses of the page: `#/` the runs, `#/runs/ID` a run, `#/compare/ID/ID/…` several runs, `#/sweeps/NAME` a sweep,
// `#/new` a new run; a `?` may add parameters.

// Decoded text of an address; null if it is malformed.
function decoded(word) {
  try {
    return decodeURIComponent(word);
  } catch {
    return null;
  }
}

// Least and largest number of names of each page.
const NAMES = { runs: [0, 1], compare: [2, Infinity], sweeps: [1, 1], new: [0, 0] };

// Returns { page, names, query }: page is "runs", "run", "compare", "sweep" or "new". A malformed address gives the
// page of the runs.
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

// Returns the address of a page with its names.
export const addressOf = (page, names) => `#/${[WORDS[page], ...names.map(encodeURIComponent)].join("/")}`;
