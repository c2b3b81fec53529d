// Colours and dashes of the lines of runs, outside of charts.

import { lineStyle } from "./axes.js";
import { h } from "./figures.js";

// A sample of line number `i` as in the charts, with its colour and dash.
export function swatch(i) {
  const { colour, dash } = lineStyle(i);
  return h(`i.swatch.dash-${dash === "solid" ? "none" : dash[0]}`, { style: { color: `var(--${colour})` } });
}
