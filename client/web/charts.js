// A chart of a run, drawn with ECharts. All charts of a page share one cursor and one zoom; charts react to pointer and
// keys, and are saved as CSV and SVG.

import { colour, whole, wrapped } from "./axes.js";
import { h } from "./figures.js";
import { echarts } from "./libraries.js";
import { readout } from "./cursorbox.js";
import { save, tableOf, toCsv } from "./tables.js";

const GROUP = "run";
// Distance from the window within which a chart is drawn at once. A chart farther away is drawn when the browser is
// idle, and again when it comes near.
const NEAR = "100px";
const KINDS = ["CSV", "SVG"]; // File formats in which a chart is saved.
const PICTURE = { width: 960, height: 420 }; // Size of a saved picture, px.
const IDLE = 2000; // Time in ms after which a chart out of view is drawn even if the browser is never idle.
// Some browsers lack requestIdleCallback.
const whenIdle = (work) => globalThis.requestIdleCallback?.(work, { timeout: IDLE }) ?? setTimeout(work, 200);

// A chart of `height` px. `option()` returns an ECharts option, or null without data. `unit` is the unit of the x axis;
// only charts over time share the cursor. Enter calls `onEnter` with the index of the cursor in the first series.
// `table()` resolves to { head, rows }, which is saved instead of the drawn points. `name()` is the beginning of the
// names of saved files. The chart is drawn after the promise `before`. `missing()` returns the text of a chart without
// data.
export class Chart {
  constructor(height, label, option, { alone = false, unit = "s", onClick, onEnter, table, before, missing = () => "", name = () => "chart" } = {}) {
    this.element = h("div.plot", { tabindex: 0, role: "img", style: { height: `${height}px` } },
      this.hint = h("p.hint"));
    Object.assign(this, { height, label, option, alone, unit, onClick, onEnter, table, missing, name, at: 0, seen: false });
    const button = (kind, act) => h("button.tab", { type: "button", title: `save as ${kind}`, onclick: act }, kind);
    this.tools = h("span.save", { hidden: "" }, button(KINDS[0], () => this.saveTable()), button(KINDS[1], () => this.savePicture()));
    this.eye = new IntersectionObserver((entries) => this.look(entries.at(-1).isIntersecting), { rootMargin: NEAR });
    this.eye.observe(this.element);
    this.watch = new ResizeObserver(() => this.resize());
    this.watch.observe(this.element);
    this.dark = matchMedia("(prefers-color-scheme: dark)");
    this.dark.addEventListener("change", this.redraw = () => this.draw());
    this.element.addEventListener("keydown", (event) => this.key(event));
    this.element.addEventListener("pointermove", ({ clientX, clientY }) => { this.pointer = [clientX, clientY]; });
    this.element.addEventListener("pointerleave", () => this.leave());
    this.element.addEventListener("blur", () => this.leave());
    this.rename(label);
    this.open(before);
  }

  rename(label) {
    this.element.setAttribute("aria-label", `${label}; arrow keys move the cursor${this.onEnter ? ", Enter opens the nearest marker" : ""}`);
    [...this.tools.children].forEach((button, i) => button.setAttribute("aria-label", `save as ${KINDS[i]}: ${label}`));
  }

  async open(before) {
    try {
      await before;
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

  // A chart out of view is drawn while the browser is idle: the first time, and later if it is `needed`.
  draw(needed = false) {
    if (this.seen) this.paint();
    else if ((needed || !this.chart) && !this.waiting) this.waiting = whenIdle(() => this.late());
  }

  resize() {
    this.chart?.resize();
    // The new width may require another number of text lines in the legend.
    if (this.chart && this.wide !== this.element.clientWidth) this.draw();
  }

  late() {
    this.waiting = 0;
    if (!this.closed) this.paint();
  }

  paint() {
    const option = this.kit && this.element.clientWidth ? this.option() : null;
    this.tools.hidden = !option;
    if (!option) {
      if (this.kit) this.hint.textContent = this.missing();
      return;
    }
    this.chart ??= this.init();
    const panels = option.grid?.length ?? 1;
    if (panels !== (this.panels ?? 1)) this.stretch(panels);
    const places = new Map(option.series.map(({ name, xAxisIndex = 0 }) => [name, xAxisIndex]));
    const moved = [...places].some(([name, place]) => (this.places?.get(name) ?? place) !== place) || panels !== (this.places?.panels ?? panels);
    const gone = [...(this.places?.keys() ?? [])].some((name) => !places.has(name));
    // ECharts fails if its cursor refers to a removed series.
    if (gone) this.chart.dispatchAction({ type: "hideTip", escapeConnect: true });
    this.places = Object.assign(places, { panels });
    // ECharts fails if a line moves to another panel.
    const how = moved ? { notMerge: true } : { replaceMerge: ["series"] };
    this.chart.setOption(wrapped(whole(this.alone, option), this.element.clientWidth), { ...how, lazyUpdate: false });
    this.wide = this.element.clientWidth;
    this.series = option.series;
    this.reads = !this.alone && !option.tooltip?.formatter;
    if (readout.of === this) this.read(this.cursor);
    this.points = Math.max(...option.series.map((one) => one.data?.length ?? 0));
  }

  // Sets the height of a chart, which is larger for several panels below each other.
  stretch(panels) {
    this.panels = panels;
    this.element.style.height = `${Math.round(this.height * (0.4 + 0.6 * panels))}px`;
    this.chart.resize();
  }

  init() {
    this.element.replaceChildren();
    const chart = this.kit.init(this.element, null, { renderer: "canvas" });
    if (!this.alone && this.unit === "s") {
      chart.group = GROUP;
      this.kit.connect(GROUP);
    }
    if (this.onClick) chart.on("click", this.onClick);
    chart.on("updateAxisPointer", ({ axesInfo }) => this.read(axesInfo?.find(({ axisDim }) => axisDim === "x")));
    return chart;
  }

  // All charts show the cursor. Only the chart with the pointer or the focus shows the values of its lines.
  read(cursor) {
    const focused = document.activeElement === this.element;
    if (!this.reads || !cursor || !(this.pointer || focused)) return;
    this.cursor = cursor;
    const { right, top, height } = this.element.getBoundingClientRect();
    readout.show(this, cursor.value, this.series, this.pointer ?? [right, top + height / 2]);
  }

  leave() {
    this.pointer = null;
    readout.hide(this);
  }

  key(event) {
    if (event.key === "Enter" && this.chart) this.onEnter?.(this.at);
    const move = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!move || !this.chart) return;
    event.preventDefault();
    this.at = Math.min(this.points - 1, Math.max(0, this.at + move * (event.shiftKey ? 10 : 1)));
    this.chart.dispatchAction({ type: "showTip", seriesIndex: 0, dataIndex: this.at });
    const point = this.series[0]?.data[this.at];
    if (point) this.read({ value: (point.value ?? point)[0] });
  }

  // Highlights the series with this name; null removes the highlight.
  highlight(seriesName) {
    this.chart?.dispatchAction({ type: "downplay" });
    if (seriesName !== null) this.chart?.dispatchAction({ type: "highlight", seriesName });
  }

  async saveTable() {
    const { head, rows } = (await this.table?.()) ?? tableOf(this.option());
    save(`${this.name()}.csv`, toCsv(head, rows), "text/csv");
  }

  savePicture() {
    const chart = this.kit.init(null, null, { renderer: "svg", ssr: true, ...PICTURE, height: PICTURE.height * (this.panels ?? 1) });
    chart.setOption({ ...whole(this.alone, this.option()), backgroundColor: colour("card") });
    save(`${this.name()}.svg`, chart.renderToSVGString(), "image/svg+xml");
    chart.dispose();
  }

  close() {
    this.closed = true;
    readout.hide(this);
    this.watch.disconnect();
    this.eye.disconnect();
    this.dark.removeEventListener("change", this.redraw);
    this.chart?.dispose();
  }
}
