// Colours and dash patterns of the lines of runs, for use outside of charts.

import { lineStyle } from "./axes.js";
import { h } from "./figures.js";

// Returns an element that shows the colour and the dash pattern of line number `i` in the charts.
export function swatch(i) {
  const { colour, dash } = lineStyle(i);
  return h(`i.swatch.dash-${dash === "solid" ? "none" : dash[0]}`, { style: { color: `var(--${colour})` } });
}
