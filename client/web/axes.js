// Parts of the ECharts option of a chart: axes with one unit each, lines and areas, marks, the tooltip.

import { exact, onAxis, percent, scaleOf, si } from "./figures.js";

export const FONT = 12;
const MOST_LINES = 3; // Largest number of text lines of a legend.
const LINE = 18; // Height of a text line of a legend, px.
const MARGIN = 7; // Space between the symbol and the text of a legend entry, px.
const DASHES = ["solid", [7, 4], [2, 3]];
// Number of line colours of the style sheet (--line-0 and so on), safe for colour blindness (Okabe and Ito 2008).
const HUES = 6;
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim() || name;

// Returns colour and dash pattern of line number `i`; the first eighteen combinations are different.
export const lineStyle = (i) => ({ colour: `line-${i % HUES}`, dash: DASHES[Math.floor(i / HUES) % DASHES.length] });

// Adds the options that all charts share to the option of a chart. The tooltip escapes names, so that they stay text.
export function whole(alone, option) {
  const all = common(alone);
  return { ...all, ...option, tooltip: { ...all.tooltip, ...option.tooltip } };
}

// Returns an option whose legend has as many text lines as it needs, up to MOST_LINES; a longer legend has pages.
export function wrapped(option, width) {
  const { legend, grid, series } = option;
  const names = legend.data ?? series.map(({ name }) => name).filter(Boolean);
  const lines = legend.show === false || !width ? 1 : linesOf(names, width, legend);
  if (lines < 2 || lines > MOST_LINES || !(grid.top >= 0)) return option;
  return { ...option, legend: { ...legend, type: "plain" }, grid: { ...grid, top: grid.top + LINE * (lines - 1) } };
}

function linesOf(names, width, { itemWidth, itemGap, left, right }) {
  const ctx = (linesOf.ctx ??= document.createElement("canvas").getContext("2d"));
  ctx.font = `${FONT}px system-ui, sans-serif`;
  let [lines, x] = [1, 0];
  for (const name of names) {
    const wide = itemWidth + MARGIN + ctx.measureText(name).width;
    if (x && x + wide > width - left - right) [lines, x] = [lines + 1, 0];
    x += wide + itemGap;
  }
  return lines;
}

// Returns the options that all charts share: colours of the theme, zoom with Ctrl and the wheel. A chart that is
// `alone` has a tooltip for one item. Any other chart has a cursor, whose values cursorbox.js shows.
export function common(alone) {
  return {
    animation: false,
    textStyle: { fontFamily: "system-ui, sans-serif", color: colour("ink") },
    grid: { left: 64, right: 14, top: 50, bottom: 26 },
    legend: { top: 0, left: 0, right: 4, type: "scroll", itemWidth: 14, itemHeight: 8, itemGap: 8, textStyle: { color: colour("soft"), fontSize: FONT, lineHeight: 18 }, inactiveColor: colour("faint"),
      pageIconColor: colour("soft"), pageIconInactiveColor: colour("line"), pageTextStyle: { color: colour("soft"), fontSize: FONT } },
    tooltip: {
      trigger: alone ? "item" : "axis", showContent: alone, renderMode: alone ? "richText" : "html", confine: true, backgroundColor: colour("card"), borderColor: colour("line"),
      textStyle: { color: colour("ink"), fontSize: FONT }, axisPointer: { type: "line", lineStyle: { color: colour("faint") } },
    },
    dataZoom: alone ? [] : [{ type: "inside", xAxisIndex: "all", zoomOnMouseWheel: "ctrl", moveOnMouseWheel: false, moveOnMouseMove: true, filterMode: "none" }],
  };
}

const rule = () => ({ lineStyle: { color: colour("line") } });
export const label = (formatter) => ({ color: colour("soft"), fontSize: FONT, hideOverlap: true, formatter });

export const time = (end, more = {}) => ({
  type: "value", min: 0, max: end, splitNumber: 4, axisLine: { ...rule(), onZero: false }, splitLine: { show: false }, axisLabel: label(onAxis(end, "s")),
  axisPointer: { label: { show: false, formatter: ({ value }) => exact(Number(value), "s", 4) } }, ...more,
});

// Returns an axis with one unit, which is written above the axis; `most` is the largest magnitude on the axis.
export function axis(unit, most, more = {}) {
  const scale = scaleOf(most, unit);
  return {
    type: "value", splitNumber: 4, axisLine: { onZero: false }, splitLine: rule(), axisLabel: label(scale.text), name: scale.unit, nameGap: 10,
    nameTextStyle: { color: colour("soft"), fontSize: FONT, align: "right", padding: [0, 6, 0, 0] }, ...more,
  };
}

// Returns a logarithmic axis with labels at powers of ten; the unit of each label has a prefix of its own.
export const logarithmic = (unit, more = {}) => ({
  type: "log", splitLine: rule(), axisLabel: label((value) => exact(value, unit, 1)), ...more,
});

export const shares = (more = {}) => ({ ...axis("", 1), min: 0, max: 1, interval: 0.25, axisLabel: label((value) => percent(value, 0)), ...more });

// Returns the largest magnitude in a list of series. For stacked series it is the magnitude of the sum at each point.
export function largest(list) {
  let most = 0;
  const sums = new Map();
  for (const { data, stack } of list) {
    for (const point of data ?? []) {
      const [x, y] = point.value ?? point;
      if (!Number.isFinite(y)) continue;
      if (stack) sums.set(x, (sums.get(x) ?? 0) + y);
      most = Math.max(most, stack ? Math.abs(sums.get(x)) : Math.abs(y));
    }
  }
  return most;
}

// series({ name, data: [[t, value]], colour, unit, … }) returns a line, or with `stack` an area on top of the areas
// before. The function `text` formats a value; its second argument is the point.
export function series({ name, data, colour: tone, unit = "", stack, dash = "solid", width = 1.8, text = (value) => si(value, unit, 4), ...more }) {
  return {
    name, unit, type: "line", data, showSymbol: data.length === 1, sampling: stack || data.length < 2000 ? undefined : "minmax", color: colour(tone), connectNulls: false,
    lineStyle: { width: stack ? 0.5 : width, type: dash }, tooltip: { valueFormatter: (value, point) => text(Array.isArray(value) ? value[1] : value, point) },
    ...(stack ? { stack, stackStrategy: "all", symbol: "none", areaStyle: { opacity: 0.85 } } : {}), emphasis: { focus: "series" }, ...more,
  };
}

// Returns the marks of an expected value with its tolerance over a time interval: a dashed line in a band.
export function expected({ value, tolerance, since, until }, tone) {
  return {
    markLine: { silent: true, symbol: "none", animation: false, label: { show: false }, lineStyle: { color: colour(tone), type: [4, 3], width: 1.4 },
      data: [[{ coord: [since, value] }, { coord: [until, value] }]] },
    markArea: { silent: true, animation: false, itemStyle: { color: colour(tone), opacity: 0.14 }, data: [[{ coord: [since, value - tolerance] }, { coord: [until, value + tolerance] }]] },
  };
}

// Returns events as pins on the time axis; a click opens an event.
export const pins = (name, data) =>
  ({ name, aside: true, type: "scatter", data, symbol: "pin", symbolSize: 22, color: colour("accent"), cursor: "pointer", z: 5, tooltip: { valueFormatter: () => "click to open" } });

// Returns points without a result, drawn as crosses.
export const crosses = (name, data) => ({ type: "scatter", aside: true, name, data, symbol: CROSS, symbolSize: 11, color: colour("bad"), cursor: "pointer", z: 6 });
const CROSS = "path://M2 0L5 3L8 0L10 2L7 5L10 8L8 10L5 7L2 10L0 8L3 5L0 2Z";

// Returns a horizontal line for the limit of a value.
export const limit = (value) =>
  ({ silent: true, symbol: "none", label: { show: false }, lineStyle: { color: colour("bad"), type: "dashed" }, data: [{ yAxis: value }] });
