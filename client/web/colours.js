// Colours of parts and fragments in the 3-D view: each part has a hue, and its fragments have variations of this hue.
// client/drawing/part_colours.py has the same function.

// OKLCH hues of the first parts, degrees.
const HUES = [252, 70, 165, 15, 305, 120, 205, 345];
// Factors 2^64 / g^k with g = 1.2207, the root of g^4 = g + 1. The multiples of these factors fill a cube evenly
// (Roberts 2018, R3).
const STEPS = [0xd1b54a32d192ed03n, 0xabc98388fb8fac03n, 0x8cb92ba72f3d8dd7n];
// Lightness and chroma of the colour of a part, and of the colour of its intact body. The colour of the intact body is
// muted, because fragments have stronger colours.
const [STRONG, MUTED] = [[0.66, 0.12], [0.84, 0.045]];
const DARKER = 0.13; // Difference of lightness between parts with the same hue.
const REST = [140, 146, 152]; // Colour of fragments that have no row in the table of fragments (number -1).

export const css = (colour) => `#${colour.map((byte) => byte.toString(16).padStart(2, "0")).join("")}`;

// Returns the colour [r, g, b] of a rank or a part by its number, from 0.
export const ofName = (number) => rgb(STRONG[0] - DARKER * (Math.floor(number / HUES.length) % 3), STRONG[1], HUES[number % HUES.length]);
export const named = (number) => css(ofName(number));

// Returns the colour [r, g, b] of the fragment `id` (BigInt) of `part`. The first `bodies` numbers stand for the bodies
// at the start.
export function ofFragment(id, part, bodies) {
  if (id < 0n) return REST;
  const hue = HUES[part % HUES.length];
  if (id < BigInt(bodies)) return rgb(...MUTED, hue);
  const [first, second, third] = STEPS.map((step) => Number(BigInt.asUintN(64, (id + 1n) * step) >> 40n) / 2 ** 24);
  return rgb(0.5 + 0.28 * first, 0.06 + 0.085 * second, hue + 44 * (third - 0.5));
}

// Returns the sRGB colour of an OKLCH colour (Ottosson 2020); the hue is in degrees.
function rgb(light, chroma, hue) {
  const [a, b] = [chroma * Math.cos(hue * (Math.PI / 180)), chroma * Math.sin(hue * (Math.PI / 180))];
  const long = (light + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const medium = (light - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const short = (light - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short,
    -1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short,
    -0.0041960863 * long - 0.7034186147 * medium + 1.707614701 * short,
  ].map((linear) => {
    const share = Math.min(1, Math.max(0, linear));
    return Math.floor(255 * (share <= 0.0031308 ? 12.92 * share : 1.055 * share ** (1 / 2.4) - 0.055) + 0.5);
  });
}
