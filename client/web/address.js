// Addresses of the page: `#/` the list of runs, `#/runs/ID` one run, `#/compare/ID/ID/…` several runs, `#/sweeps/NAME`
// a sweep, `#/new` a new run. Parameters may follow after a `?`.

// Returns the decoded text of an address, or null if the address is malformed.
function decoded(word) {
  try {
    return decodeURIComponent(word);
  } catch {
    return null;
  }
}

// Smallest and largest number of names in the address of each page.
const NAMES = { runs: [0, 1], compare: [2, Infinity], sweeps: [1, 1], new: [0, 0] };

// Returns { page, names, query }; page is "runs", "run", "compare", "sweep" or "new". A malformed address means the
// list of runs.
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

// Returns the address of a page for a list of names.
export const addressOf = (page, names) => `#/${[WORDS[page], ...names.map(encodeURIComponent)].join("/")}`;
