// The charts of a run on ECharts: one cursor and one zoom for all of them, keys as well as the pointer.

import { exact, h, onAxis, percent, si } from "./figures.js";
import { echarts } from "./libraries.js";

const GROUP = "run";
const FONT = 12;
const NEAR = "100px"; // Of the window: a chart farther off is drawn when there is time, and again when it comes near.
const whenIdle = globalThis.requestIdleCallback ?? ((work) => setTimeout(work, 200)); // Not every browser has it.
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// A chart of `height` px. `option()` gives what ECharts calls an option, or null while there is nothing to draw.
// `onEnter` gets the place of the cursor in the first series when Enter is pressed.
export class Chart {
  constructor(height, label, option, { alone = false, onClick, onEnter } = {}) {
    this.element = h("div.plot", { tabindex: 0, role: "img", "aria-label": `${label}; arrow keys move the cursor${onEnter ? ", Enter opens the nearest marker" : ""}`, style: { height: `${height}px` } },
      h("p.hint", {}, "waiting for the first numbers"));
    Object.assign(this, { option, alone, onClick, onEnter, at: 0, seen: false });
    this.eye = new IntersectionObserver((entries) => this.look(entries.at(-1).isIntersecting), { rootMargin: NEAR });
    this.eye.observe(this.element);
    this.watch = new ResizeObserver(() => this.chart?.resize());
    this.watch.observe(this.element);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.dark.addEventListener("change", this.redraw = () => this.draw());
    this.element.addEventListener("keydown", (event) => this.key(event));
    this.open();
  }

  async open() {
    try {
      this.kit = await echarts();
      this.draw();
    } catch (error) {
      this.element.replaceChildren(h("p.hint", {}, `No charts: ${error.message}`));
    }
  }

  look(seen) {
    const stale = seen && !this.seen;
    this.seen = seen;
    if (stale) this.draw();
  }

  // Out of view only the first time, and where that is `needed`.
  draw(needed = false) {
    if (this.seen) this.paint();
    else if ((needed || !this.chart) && !this.waiting) this.waiting = whenIdle(() => this.late());
  }

  late() {
    this.waiting = 0;
    if (!this.closed) this.paint();
  }

  paint() {
    const option = this.kit && this.element.clientWidth ? this.option() : null;
    if (!option) return;
    this.chart ??= this.init();
    this.chart.setOption({ ...common(this.alone), ...option }, { replaceMerge: ["series"], lazyUpdate: false });
    this.points = Math.max(...option.series.map((one) => one.data?.length ?? 0));
  }

  init() {
    this.element.replaceChildren();
    const chart = this.kit.init(this.element, null, { renderer: "canvas" });
    if (!this.alone) {
      chart.group = GROUP;
      this.kit.connect(GROUP);
    }
    if (this.onClick) chart.on("click", this.onClick);
    return chart;
  }

  key(event) {
    if (event.key === "Enter" && this.chart) this.onEnter?.(this.at);
    const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!move || !this.chart) return;
    event.preventDefault();
    this.at = Math.min(this.points - 1, Math.max(0, this.at + move * (event.shiftKey ? 10 : 1)));
    this.chart.dispatchAction({ type: "showTip", seriesIndex: 0, dataIndex: this.at });
  }

  close() {
    this.closed = true;
    this.watch.disconnect();
    this.eye.disconnect();
    this.dark.removeEventListener("change", this.redraw);
    this.chart?.dispose();
  }
}

// What all have: the theme's colours, a tip without markup, zoom by dragging in the chart with Ctrl and the wheel.
function common(alone) {
  return {
    animation: false,
    textStyle: { fontFamily: "system-ui, sans-serif", color: colour("ink") },
    grid: { left: 64, right: 14, top: 30, bottom: 26 },
    legend: { top: 0, left: 0, type: "scroll", itemWidth: 10, itemHeight: 10, textStyle: { color: colour("soft"), fontSize: FONT }, inactiveColor: colour("faint") },
    tooltip: {
      trigger: alone ? "item" : "axis", renderMode: "richText", confine: true, backgroundColor: colour("card"), borderColor: colour("line"),
      textStyle: { color: colour("ink"), fontSize: FONT }, axisPointer: { type: "line", lineStyle: { color: colour("faint") } },
    },
    dataZoom: alone ? [] : [{ type: "inside", zoomOnMouseWheel: "ctrl", moveOnMouseWheel: false, moveOnMouseMove: true, filterMode: "none" }],
  };
}

const line = () => ({ lineStyle: { color: colour("line") } });
const label = (unit) => ({ color: colour("soft"), fontSize: FONT, hideOverlap: true, formatter: (value) => exact(value, unit, 3) });

export const time = (end, more = {}) =>
  ({ type: "value", min: 0, max: end, axisLine: line(), splitLine: { show: false }, axisLabel: { ...label("s"), formatter: onAxis(end, "s") }, axisPointer: { label: { show: false, formatter: ({ value }) => exact(Number(value), "s", 4) } }, ...more });
export const axis = (unit, more = {}) =>
  ({ type: "value", splitNumber: 4, scale: more.scale ?? false, splitLine: line(), axisLabel: label(unit), ...more });

// series({ name, data: [[t, value]], colour, … }): a line, or with `stack` an area on those before.
export function series({ name, data, colour: tone, unit = "", stack, ...more }) {
  const body = colour(tone) || tone;
  return {
    name, type: "line", data, showSymbol: false, sampling: stack ? undefined : "lttb", color: body,
    lineStyle: { width: stack ? 0.5 : 1.8 }, tooltip: { valueFormatter: (value) => si(Array.isArray(value) ? value[1] : value, unit) },
    ...(stack ? { stack, areaStyle: { opacity: 0.85 } } : {}), ...more,
  };
}

// Events as pins; `pick` finds the event of a click by its place in the list.
export const pins = (name, data) =>
  ({ name, type: "scatter", data, symbol: "pin", symbolSize: 22, color: colour("accent"), cursor: "pointer", z: 5, tooltip: { valueFormatter: () => "click to open" } });

// A horizontal line that a value should not pass.
export const limit = (value) =>
  ({ silent: true, symbol: "none", label: { show: false }, lineStyle: { color: colour("bad"), type: "dashed" }, data: [{ yAxis: value }] });

// cells [t, rank, share]: the colour says how a rank compares with the busiest one of the same moment.
export function heat(ranks, times, cells) {
  return {
    legend: { show: false }, tooltip: { ...common(true).tooltip, formatter: ({ value: [at, rank, share] }) => `${si(times[at], "s")}\nrank ${rank}: ${percent(share, 0)} of the busiest` },
    xAxis: { type: "category", data: times, axisLine: line(), axisTick: { show: false }, axisLabel: { ...label("s"), formatter: (value) => onAxis(times.at(-1), "s")(Number(value)) } },
    yAxis: { type: "category", data: Array.from({ length: ranks }, (_, rank) => `rank ${rank}`), inverse: true, axisLine: line(), axisTick: { show: false }, axisLabel: { color: colour("soft"), fontSize: FONT } },
    visualMap: { show: false, min: 0, max: 1, dimension: 2, inRange: { color: [colour("card"), colour("compute")] } },
    series: [{ type: "heatmap", data: cells, progressive: 0 }],
  };
}
