// Colours of the view: one for each of many, and a scale from low to high that grey prints and the colour blind keep apart.

const NAMED = ["#3b7dd8", "#e07b39", "#2aa198", "#c2334a", "#8e6bd1", "#7f9f2f", "#d05a8c", "#5c6977", "#e0a32e", "#4fae7b"];
// Of the viridis scale (van der Walt and Smith 2015, CC0), at equal distances, without its darkest part.
const SCALE = ["#355f8d", "#2a788e", "#21918c", "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"];

const bytes = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

// Of the number of a rank or a part.
export const named = (number) => NAMED[number % NAMED.length];
export const SCALE_CSS = `linear-gradient(90deg, ${SCALE.join(", ")})`;

// 256 colours as RGBA bytes: of numbers from 0 on, or of a scale.
export function map(scale) {
  const out = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; i += 1) out.set([...(scale ? between(i / 255) : bytes(named(i))), 255], 4 * i);
  return out;
}

function between(share) {
  const at = share * (SCALE.length - 1);
  const [a, b] = [SCALE[Math.floor(at)], SCALE[Math.ceil(at)]].map(bytes);
  return a.map((low, i) => Math.round(low + (b[i] - low) * (at % 1)));
}

// Of what was there at the start: muted, so that what has broken off stands out.
const BODIES = ["#c9d3dc", "#d9cbb3", "#b7c9bd", "#c9bddb", "#dcc0c0", "#bcd2d8"];

// The colour of a fragment, by its number alone: scales.py has the same. The first `bodies` numbers are those of the start.
export function ofFragment(id, bodies) {
  if (id < 0n) return [140, 146, 152];
  if (id < BigInt(bodies)) return bytes(BODIES[Number(id) % BODIES.length]);
  const turn = Number((BigInt.asUintN(64, (id + 1n) * 0x9e3779b97f4a7c15n)) >> 40n) / 2 ** 24;
  const light = 0.55 + 0.14 * (Number((id * 2654435761n) & 255n) / 255 - 0.5);
  return [0, 8, 4].map((n) => {
    const k = (n + turn * 12) % 12;
    return Math.floor(255 * (light - 0.2 * Math.max(-1, Math.min(k - 3, 9 - k, 1))) + 0.5);
  });
}
