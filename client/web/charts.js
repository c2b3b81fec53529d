// Three drawings on canvas: stacked areas, lines (linear or logarithmic), and a rank x time map.

import { h, si } from "./figures.js";

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const MOST_DECADES = 6;
const PAD = { left: 58, right: 10, top: 8, bottom: 24 };

// A canvas of a fixed height that follows the width of its holder and the theme, with a tip under the pointer.
export class Chart {
  constructor(height, label, draw, tip) {
    this.canvas = h("canvas", { role: "img", "aria-label": label });
    this.tip = h("div.tip", { hidden: "" });
    this.element = h("div.plot", {}, this.canvas, this.tip);
    Object.assign(this, { height, drawing: draw, telling: tip, pointer: null });
    this.canvas.addEventListener("pointermove", (event) => this.point(event.offsetX));
    this.canvas.addEventListener("pointerleave", () => this.point(null));
    new ResizeObserver(() => this.draw()).observe(this.element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  point(x) {
    this.pointer = x;
    this.draw();
  }

  draw() {
    const width = this.element.clientWidth;
    if (!width) return;
    const scale = devicePixelRatio || 1;
    Object.assign(this.canvas, { width: width * scale, height: this.height * scale });
    this.canvas.style.height = `${this.height}px`;
    const context = this.canvas.getContext("2d");
    context.scale(scale, scale);
    context.font = "12px system-ui, 'DejaVu Sans', sans-serif";
    const area = { x: PAD.left, y: PAD.top, width: width - PAD.left - PAD.right, height: this.height - PAD.top - PAD.bottom };
    this.drawing(context, area);
    this.showTip(context, area);
  }

  showTip(context, area) {
    const inside = this.pointer !== null && this.pointer >= area.x && this.pointer <= area.x + area.width;
    const told = inside ? this.telling((this.pointer - area.x) / area.width) : null;
    this.tip.hidden = !told;
    if (!told) return;
    context.fillStyle = colour("faint");
    context.fillRect(Math.round(this.pointer), area.y, 1, area.height);
    this.tip.replaceChildren(...told.map((text) => h("div", {}, text)));
    const right = this.pointer > area.x + area.width / 2;
    this.tip.style.left = right ? "auto" : `${this.pointer + 12}px`;
    this.tip.style.right = right ? `${area.x + area.width + PAD.right - this.pointer + 12}px` : "auto";
  }
}

const tidy = (text) => text.replace(/\.?0+(?= )/, (zeros) => (zeros.startsWith(".") ? "" : zeros)).replace(/(\.\d*[1-9])0+ /, "$1 ");

function ticks(low, high, most) {
  const span = high - low || 1;
  const power = 10 ** Math.floor(Math.log10(span / most));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => span / size <= most);
  const first = Math.ceil(low / step - 1e-9);
  const number = Math.floor(high / step + 1e-9) - first + 1;
  return Array.from({ length: Math.max(0, number) }, (_, i) => (first + i) * step);
}

function axes(context, area, { xs, x, xUnit, ys, y, yLabel }) {
  context.strokeStyle = colour("line");
  context.fillStyle = colour("soft");
  context.lineWidth = 1;
  context.textAlign = "right";
  context.textBaseline = "middle";
  for (const value of ys) {
    const place = Math.round(y(value)) + 0.5;
    context.beginPath();
    context.moveTo(area.x, place);
    context.lineTo(area.x + area.width, place);
    context.stroke();
    context.fillText(yLabel(value), area.x - 8, place);
  }
  context.textBaseline = "alphabetic";
  for (const value of xs) {
    const place = x(value);
    context.textAlign = place > area.x + area.width - 30 ? "right" : place < area.x + 16 ? "left" : "center";
    context.fillText(tidy(si(value, xUnit)), place, area.y + area.height + 17);
  }
}

function scales(area, t0, t1, low, high) {
  return {
    x: (value) => area.x + (area.width * (value - t0)) / (t1 - t0 || 1),
    y: (value) => area.y + area.height * (1 - (value - low) / (high - low || 1)),
  };
}

// points: [{ t, values: [number a series] }], colours: names of CSS variables; areas from 0 upwards.
export function areas(context, area, points, colours, unit, end) {
  if (points.length < 2) return waiting(context, area);
  const sums = points.map(({ values }) => values.reduce((sum, value) => sum + Math.max(0, value), 0));
  const high = 1.06 * Math.max(...sums, 1e-300);
  const { x, y } = scales(area, 0, end, 0, high);
  axes(context, area, { xs: ticks(0, end, area.width / 90), x, xUnit: "s", ys: ticks(0, high, 4), y, yLabel: (value) => tidy(si(value, unit)) });
  let below = points.map(() => 0);
  colours.forEach((name, series) => {
    const above = points.map(({ values }, i) => below[i] + Math.max(0, values[series]));
    context.beginPath();
    points.forEach(({ t }, i) => context.lineTo(x(t), y(above[i])));
    for (let i = points.length - 1; i >= 0; i -= 1) context.lineTo(x(points[i].t), y(below[i]));
    context.globalAlpha = 0.85;
    context.fillStyle = colour(name);
    context.fill();
    context.globalAlpha = 1;
    below = above;
  });
}

// points: [{ t, value }]; logarithmic between powers of ten when `log`, else from `floor` upwards.
export function line(context, area, points, name, { end, log = false, floor = 0, label, marks = [] }) {
  if (points.length < 2) return waiting(context, area);
  const measure = log ? (value) => Math.log10(Math.max(value, 1e-12)) : (value) => value;
  const values = points.map(({ value }) => measure(value));
  const top = Math.max(...values, ...marks.map(measure));
  const high = log ? Math.ceil(top + 1e-9) : Math.max(1.1 * top, floor + 0.1);
  const low = log ? Math.max(high - MOST_DECADES, Math.min(Math.floor(Math.min(...values)), high - 2)) : floor;
  const { x, y } = scales(area, 0, end, low, high);
  const ys = log ? ticks(low, high, MOST_DECADES) : ticks(low, high, 4);
  axes(context, area, { xs: ticks(0, end, area.width / 90), x, xUnit: "s", ys, y, yLabel: label });
  context.strokeStyle = colour(name);
  context.lineWidth = 1.8;
  context.lineJoin = "round";
  context.beginPath();
  points.forEach(({ t }, i) => context.lineTo(x(t), y(Math.max(values[i], low))));
  context.stroke();
  context.setLineDash([4, 4]);
  context.strokeStyle = colour("bad");
  context.lineWidth = 1;
  for (const mark of marks) {
    context.beginPath();
    context.moveTo(area.x, y(measure(mark)));
    context.lineTo(area.x + area.width, y(measure(mark)));
    context.stroke();
  }
  context.setLineDash([]);
}

// points: [{ t, busy: [0..1 a rank] }]: one column a Load message, one row a rank, the fuller the busier.
export function heat(context, area, points, end) {
  if (points.length < 2) return waiting(context, area);
  const ranks = points.at(-1).busy.length;
  const { x } = scales(area, 0, end, 0, 1);
  const rows = Array.from({ length: ranks }, (_, rank) => rank);
  const y = (rank) => area.y + (area.height * (rank + 0.5)) / ranks;
  const every = Math.ceil((ranks * 16) / area.height);
  axes(context, area, { xs: ticks(0, end, area.width / 90), x, xUnit: "s", ys: rows.filter((rank) => rank % every === 0), y, yLabel: (rank) => `rank ${rank}` });
  context.fillStyle = colour("track");
  context.fillRect(area.x, area.y, x(points.at(-1).t) - area.x, area.height);
  context.fillStyle = colour("compute");
  points.forEach(({ t, busy }, i) => {
    const left = i ? x(points[i - 1].t) : area.x;
    busy.forEach((share, rank) => {
      context.globalAlpha = 0.06 + 0.94 * share ** 1.5;
      context.fillRect(left, area.y + (area.height * rank) / ranks, Math.max(0.6, x(t) - left), Math.max(1, area.height / ranks - 1));
    });
  });
  context.globalAlpha = 1;
}

function waiting(context, area) {
  context.fillStyle = colour("faint");
  context.textAlign = "center";
  context.fillText("waiting for the first numbers", area.x + area.width / 2, area.y + area.height / 2);
}

// The point nearest before a time.
export function at(points, t) {
  let found = points[0];
  for (const point of points) {
    if (point.t > t) break;
    found = point;
  }
  return found;
}
