// How lines of many runs are told apart outside of a chart.

import { lineStyle } from "./axes.js";
import { h } from "./figures.js";

// A piece of the line number `i` as charts draw it, with its colour and its dashes.
export function swatch(i) {
  const { colour, dash } = lineStyle(i);
  return h(`i.swatch.dash-${dash === "solid" ? "none" : dash[0]}`, { style: { color: `var(--${colour})` } });
}
