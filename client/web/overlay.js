// Drawing over the 3-D view: axes, scale bar, legend, time. The drawing is a canvas, so that a saved picture shows the
// same as the page.

import { alike, si } from "./figures.js";

const PAD = 12; // Distance of the drawing from the border, px.
const ARM = 26; // Length of an axis, px.
const BAR = [12, 150]; // Width and height of the colour bar, px.
const SWATCH = 11; // Size of a colour sample in the legend, px.
const NAMES = 12; // Largest number of names in a legend.
const ROUND = [1, 2, 5];
const AXIS_TONES = ["#d64545", "#3c9a4e", "#3f73d8"];
const FONT = '"Segoe UI", system-ui, Roboto, "DejaVu Sans", sans-serif';

// Draws axes, scale bar, legend and time. `ctx` is in CSS pixels; `frame`: { width, height, camera, distance, legend,
// caption, bar, axes, ink, soft, paper }.
export function draw(ctx, frame) {
  ctx.clearRect(0, 0, frame.width, frame.height);
  ctx.textBaseline = "middle";
  ctx.lineJoin = "round";
  if (frame.axes) axes(ctx, frame);
  if (frame.bar) bar(ctx, frame);
  if (frame.legend) legend(ctx, frame);
  if (frame.caption) text(ctx, frame, frame.caption, PAD, PAD + 6, 12.5, frame.ink, "left", 600);
}

// Writes a text with a rim in the colour of the background, so that the text is readable in front of any body.
function text(ctx, { ink, paper }, words, x, y, size = 12, colour = ink, align = "left", weight = 400) {
  ctx.font = `${weight} ${size}px ${FONT}`;
  ctx.textAlign = align;
  ctx.strokeStyle = paper;
  ctx.lineWidth = 3;
  ctx.strokeText(words, x, y);
  ctx.fillStyle = colour;
  ctx.fillText(words, x, y);
}

function axes(ctx, frame) {
  const { camera, height } = frame;
  const [x, y] = [PAD + 1.25 * ARM, height - PAD - 1.25 * ARM];
  const m = camera.matrixWorldInverse.elements;
  const ends = ["x", "y", "z"].map((name, i) => ({ name, tone: AXIS_TONES[i], right: m[4 * i], up: m[4 * i + 1], near: m[4 * i + 2] }));
  for (const { name, tone, right, up } of ends.sort((a, b) => a.near - b.near)) {
    ctx.strokeStyle = tone;
    ctx.lineWidth = 2.5;
    ctx.beginPath();
    ctx.moveTo(x, y);
    ctx.lineTo(x + ARM * right, y - ARM * up);
    ctx.stroke();
    text(ctx, frame, name, x + 1.32 * ARM * right, y - 1.32 * ARM * up, 12, tone, "center", 600);
  }
}

// Draws the scale bar. The scale is exact at the depth of the point about which the camera turns.
function bar(ctx, frame) {
  const { width, height, camera, distance } = frame;
  const metre = height / (2 * distance * Math.tan((camera.fov * Math.PI) / 360));
  const most = Math.min(160, width / 4) / metre;
  const power = 10 ** Math.floor(Math.log10(most));
  const length = power * Math.max(...ROUND.filter((factor) => factor * power <= most));
  const [x, y, wide] = [width - PAD - length * metre, height - PAD - 4, length * metre];
  for (const [colour, line] of [[frame.paper, 5], [frame.ink, 2]]) {
    ctx.strokeStyle = colour;
    ctx.lineWidth = line;
    ctx.beginPath();
    ctx.moveTo(x, y - 5);
    ctx.lineTo(x, y);
    ctx.lineTo(x + wide, y);
    ctx.lineTo(x + wide, y - 5);
    ctx.stroke();
  }
  text(ctx, frame, round(length), x + wide / 2, y - 9, 12, frame.ink, "center");
}

// Returns the text of a length, such as "5 mm" for 5e-3, without zeros at the end of the decimals.
const round = (length) => si(length, "m").replace(/(\.\d*?)0+(?= )/, "$1").replace(/\.(?= )/, "");

function legend(ctx, frame) {
  const { legend: { title, names, arrows } } = frame;
  const x = frame.width - PAD;
  text(ctx, frame, title, x, PAD + 6, 12.5, frame.ink, "right", 600);
  const end = names ? named(ctx, frame, x, PAD + 26) : scale(ctx, frame, x, PAD + 26);
  if (arrows) text(ctx, frame, `longest arrow ${si(arrows, "m/s")}`, x, end + 18, 12, frame.ink, "right");
}

function named(ctx, frame, x, y) {
  const { names } = frame.legend;
  const shown = names.slice(0, NAMES);
  const wide = Math.max(...shown.map(({ colours }) => colours.length)) * SWATCH;
  shown.forEach(({ name, colours }, i) => {
    colours.forEach((colour, k) => {
      ctx.fillStyle = colour;
      ctx.fillRect(x - wide + SWATCH * k, y + 18 * i - 5.5, SWATCH, SWATCH);
    });
    text(ctx, frame, name, x - wide - 6, y + 18 * i, 12, frame.ink, "right");
  });
  if (names.length > NAMES) text(ctx, frame, `and ${names.length - NAMES} more`, x, y + 18 * NAMES, 12, frame.soft, "right");
  return y + 18 * Math.min(names.length, NAMES + 1) - 6;
}

function scale(ctx, frame, x, y) {
  const { colours, low, high, number, unit, uniform } = frame.legend;
  if (uniform) {
    text(ctx, frame, `${si(low, unit)} everywhere`, x, y, 12, frame.ink, "right");
    return y + 6;
  }
  const [wide] = BAR;
  const tall = Math.max(40, Math.min(BAR[1], frame.height / 2 - y));
  for (let i = 0; i < tall; i += 1) {
    const at = 4 * Math.round((255 * (tall - 1 - i)) / (tall - 1));
    ctx.fillStyle = `rgb(${colours[at]}, ${colours[at + 1]}, ${colours[at + 2]})`;
    ctx.fillRect(x - wide, y + i, wide, 1.5);
  }
  ctx.strokeStyle = frame.soft;
  ctx.lineWidth = 1;
  ctx.strokeRect(x - wide - 0.5, y - 0.5, wide + 1, tall + 1);
  const fits = labels(number, Math.floor(tall / 16) + 1);
  const values = Array.from({ length: fits }, (_, i) => low + ((high - low) * i) / (fits - 1));
  alike(values, unit).forEach((words, i) => text(ctx, frame, words, x - wide - 6, y + tall * (1 - i / (fits - 1)), 12, frame.ink, "right"));
  return y + tall;
}

// Returns the step between labels if `number` round values have space for `most` labels: all, every second or third, or
// only the ends.
const labels = (number, most) => [1, 2, 3].map((step) => (number - 1) / step + 1).find((some) => Number.isInteger(some) && some <= most) ?? 2;
