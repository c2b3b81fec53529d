// Ends of the colour scale: from the shown snapshot or from the whole run, with or without extremes, or given by the
// user.

import { rounded, scaleOf } from "./scales.js";

const ALIKE = 1e-9; // Relative difference below which two values are equal except for rounding.
// Quantiles of the values of triangles, as in the message of a snapshot (docs/snapshots.md).
const EXTREMES = [0.005, 0.995];

// Returns { low, high, number, uniform } for a field of the shown snapshots. `choice`: { how: "most" | "all" | "hand",
// over: "run" | "now", hand: [low, high] }. `inRun`: ranges of the field in the messages of all snapshots, each [least,
// low, high, most].
export function range(choice, name, snapshots, inRun) {
  if (choice.how === "hand" && choice.hand) return { low: choice.hand[0], high: choice.hand[1], number: 5 };
  const all = choice.how === "all";
  const known = choice.over === "run" ? inRun.map(([least, low, high, most]) => (all ? [least, most] : [low, high])) : [];
  const found = known.length ? known : snapshots.map((one) => (all ? extent(one, name) : most(one, name)));
  const [low, high] = [Math.min(...found.map(([least]) => least)), Math.max(...found.map(([, largest]) => largest))];
  if (high - low <= ALIKE * Math.max(Math.abs(low), Math.abs(high))) return { low, high, number: 1, uniform: true };
  return nice(low, high, scaleOf(name).centred);
}

const extent = ({ header }, name) => [header.fields[name].low, header.fields[name].high];

// Returns the range of the values of triangles without the extremes.
function most(snapshot, name) {
  const levels = snapshot.arrays[`field:${name}`];
  const [low, high] = extent(snapshot, name);
  const counts = new Uint32Array(256);
  for (const level of levels) counts[level] += 1;
  return EXTREMES.map((share) => low + ((high - low) * reached(counts, share * levels.length)) / 255);
}

function reached(counts, number) {
  let sum = 0;
  for (let level = 0; level < counts.length; level += 1) {
    sum += counts[level];
    if (sum > number) return level;
  }
  return counts.length - 1;
}

function nice(low, high, centred) {
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const ends = centred ? [-largest, largest] : low > 0 && low < 0.1 * high ? [0, high] : [low, high];
  const [first, last, number] = rounded(...ends);
  return { low: first, high: last, number };
}
