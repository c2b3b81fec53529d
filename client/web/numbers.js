// Numbers of a run: the five main numbers, and all other numbers.

import { alike, count, duration, fixed, h, large, moment, rough, si, vector } from "./figures.js";
import { FINAL } from "./live.js";
import { fold } from "./storage.js";

const FINE = 1e-3; // Residual of the energy balance below which the balance counts as closed.
const entry = (name, value, note) =>
  h("div", {}, h("dt", {}, name), h("dd", {}, h("span.value", {}, value), note ? h("small", {}, note) : null));

export class Numbers {
  constructor() {
    this.strip = h("dl.facts.strip");
    this.rest = h("dl.facts");
    this.element = h("section.card", { "aria-label": "numbers" }, this.strip, fold("numbers", false, "All numbers", this.rest));
  }

  draw(live, info, outcome) {
    this.strip.replaceChildren(...five(live, outcome));
    this.rest.replaceChildren(...others(live, info, outcome));
  }
}

// Returns the main numbers: time with remaining time, dt with its limiter, residual, fragments, imbalance.
function five(live, outcome) {
  const { progress, load, counts, state } = live;
  const over = FINAL.has(state);
  const left = over ? `took ${duration(live.elapsed)}` : Number.isFinite(progress?.eta) ? `${duration(progress.eta)} left` : "";
  const { t, residual: worst } = ended(progress, outcome);
  return [
    entry("time", progress ? timed(t, progress.end_time) : "–", left),
    entry("dt", si(progress?.dt || live.ledger.findLast(({ dt }) => dt > 0)?.dt, "s"), progress?.limiter && `held by ${progress.limiter}`),
    entry("energy residual", worst ? residual(...worst) : "–"),
    entry("fragments", count(counts?.fragments)),
    alone(live) ? entry("imbalance", "–", "one rank") : entry("imbalance", load ? fixed(load.imbalance) : "–"),
  ];
}

// True for a run on one rank, which has no load imbalance.
export const alone = ({ plan, loads }) => (plan?.run?.ranks ?? loads.at(-1)?.shares.length) === 1;

function others(live, info, outcome) {
  const { progress, counts, started } = live;
  const crack = Number.isFinite(outcome?.first_break) ? si(outcome.first_break, "s", 4) : firstCrack(live);
  return [
    entry("elapsed", duration(live.elapsed)),
    entry("step", count(ended(progress, outcome).step)),
    entry("updates a second", large(progress?.updates_per_second)),
    entry("elements", count(counts?.elements ?? started?.elements)),
    entry("nodes", count(counts?.nodes ?? started?.nodes)),
    crack ? entry("first broken facet", crack) : "",
    entry("shared nodes", count(counts?.shared)),
    counts?.particles ? entry("particles", count(counts.particles)) : "",
    entry("ranks × threads", info.ranks ? `${info.ranks} × ${info.threads ?? 1}` : "–"),
    entry("submitted", info.submitted ? moment(info.submitted) : "–"),
    info.finished ? entry("ended", moment(info.finished)) : "",
    ...Object.entries(info.labels ?? {}).map(([name, value]) => entry(name, value)),
  ].filter(Boolean);
}

// Returns the time interval in which the first facet broke: from the last report without a broken facet to the first
// report with a broken facet.
export function firstCrack({ sizes }) {
  const at = sizes.findIndex(({ facets }) => facets > 0);
  if (at < 0) return "";
  return at ? vector([sizes[at - 1].t, sizes[at].t], "s", 3, " to ") : `up to ${si(sizes[at].t, "s")}`;
}

// Returns the present state of a run, from its outcome or its newest report. `residual` is [value, whether the value is
// above the limit].
export function ended(progress, outcome) {
  const failed = outcome?.cause === "energy";
  const energy = failed ? outcome.worst_residual : outcome?.energy?.residual;
  const value = energy ?? progress?.energy?.residual;
  const beyond = failed && !(value < FINE); // The run may have failed because of one term of the energy balance.
  return { t: outcome?.time ?? progress?.t, step: outcome?.steps ?? progress?.step, residual: Number.isFinite(value) ? [value, beyond] : null };
}

// Returns two texts, the present simulated time and "of" with the end time, both in one unit.
function timed(now, end) {
  const [first, last] = alike([now, end], "s");
  return first === last ? last : `${first} of ${last}`;
}

export function residual(value, failed = false) {
  const tone = failed ? "bad" : value < FINE ? "good" : value < 1e-2 ? "warn" : "bad";
  return h(`span.${tone}`, {}, rough(value));
}
