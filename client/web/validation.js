// Result of the check of a case: problems, warnings, estimate, and the files of the case.

import { count, counted, duration, h, percent, si, size } from "./figures.js";

const MOST = 50; // Largest number of problems that are listed.

// Returns the elements of the result. `lines`: line of each problem in the text, -1 if unknown; `onLine` is called with
// the line that the user selects.
export function verdict(text, busy, checks, lines, onLine) {
  if (!text.trim()) return h("p.hint", {}, "Nothing to check yet.");
  if (!checks) return h("p.hint", {}, busy || "not checked yet");
  const { valid, problems, warnings = [], estimate = {} } = checks;
  const head = valid ? h("p.good", {}, h("b", {}, "This case can be run.")) : problems.length ? h("p.bad", {}, h("b", {}, counted(problems.length, "problem")))
    : h("p.warn", {}, h("b", {}, "Files are missing."));
  return h("div", {}, h("div.verdict", {}, head, h("span.hint", {}, busy)), valid ? expected(estimate) : "",
    h("ul.problems", {}, problems.slice(0, MOST).map((one, i) => h("li", {}, line(one, lines[i], onLine)))),
    warnings.length ? h("details.fold", { open: "" }, h("summary", {}, counted(warnings.length, "warning")), h("ul.warnings", { tabindex: 0, "aria-label": "warnings" },
      warnings.map((one) => h("li", {}, sentence(one))))) : "");
}

function line(one, at, onLine) {
  if (at < 0) return h("span", {}, sentence(one));
  return h("button.text", { type: "button", onclick: () => onLine(at) }, h("small", {}, `line ${at + 1} `), sentence(one));
}

const sentence = ({ key, value, message }) => [h("b", {}, [key, value && `= ${value}`].filter(Boolean).join(" ")), key ? ": " : "", message];

function expected({ elements, nodes, dt, steps, memory_bytes: memory, seconds }) {
  const entry = (name, value) => h("div", {}, h("dt", {}, name), h("dd", {}, value));
  return h("dl.facts", {}, entry("elements", count(elements)), entry("nodes", count(nodes)), entry("dt", si(dt, "s")),
    entry("steps", count(steps)), entry("memory", size(memory)), entry("takes about", duration(seconds)));
}

const WORDS = { missing: "needed: drop it here or choose it", asking: "asking the server …", ready: "waits", sent: "on the server" };

// Returns a table of files: the files that the case names, with their progress, then the other files.
export function filesTable(named, outbox) {
  const spare = outbox.spare(named);
  if (!named.length && !spare.length) return h("p.hint", {}, "The case names none.");
  return h("table.listing", {}, h("tbody", {},
    named.map((file) => row(file.path, outbox.stateOf(file))),
    spare.map((name) => h("tr", {}, h("td", {}, name), h("td.number", {}, "not named by the case ", h("button.text", { type: "button", "aria-label": `remove ${name}`, onclick: () => outbox.remove(name) }, "remove"))))));
}

function row(path, { state, share, error }) {
  const words = state === "hashing" ? `reading ${percent(share, 0)}` : state === "sending" ? `sending ${percent(share, 0)}` : WORDS[state] ?? error;
  const tone = { missing: "warn", failed: "bad", sent: "good" }[state] ?? "soft";
  return h("tr", {}, h("td", {}, path), h(`td.number.${tone}`, {}, words));
}
