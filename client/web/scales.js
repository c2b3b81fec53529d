// Scale of each field: name, colours, and round numbers at the ends. client/drawing/fields.py and scales.py have the
// same scales.

// Perceptually uniform colour scales (van der Walt and Smith 2015, CC0; cividis: Nunez, Anderton and Renslow 2018)
// without their darkest part, and a diverging scale (RdBu of ColorBrewer, Harrower and Brewer 2003).
const VIRIDIS = ["#355f8d", "#2a788e", "#21918c", "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"];
const CIVIDIS = ["#3b496c", "#575d6d", "#707173", "#8a8779", "#a59c74", "#c3b369", "#e1cc55", "#fee838"];
const PLASMA = ["#5302a3", "#8b0aa5", "#b83289", "#db5c68", "#f48849", "#febd2a", "#f0f921"];
const STRAINED = ["#d9dfe6", "#f7d889", "#f49a3d", "#d4432c", "#7c0f34"];
const DIVERGING = ["#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582", "#d6604d", "#b2182b", "#67001f"];
export const UNIFORM = ["#9fb0c0", "#9fb0c0"]; // Colour of a uniform field; no colour scale contains this colour.

const KNOWN = {
  mises: { label: "von Mises stress" },
  pressure: { label: "pressure", colours: DIVERGING, centred: true },
  principal_stress: { label: "largest principal stress", colours: DIVERGING, centred: true },
  damage: { label: "damage", colours: STRAINED },
  broken_faces: { label: "broken faces", colours: STRAINED },
  plastic_strain: { label: "plastic strain", colours: STRAINED },
  temperature: { label: "temperature", colours: PLASMA },
  speed: { label: "speed", colours: CIVIDIS },
};

// Returns { label, colours, centred } of a field.
export const scaleOf = (name) => ({ label: name.replaceAll("_", " "), colours: VIRIDIS, centred: false, ...KNOWN[name] });

const bytes = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

// Returns the colour [r, g, b] at a position (0 to 1) of a scale.
function between(colours, share) {
  const at = share * (colours.length - 1);
  const [a, b] = [colours[Math.floor(at)], colours[Math.ceil(at)]].map(bytes);
  return a.map((low, i) => Math.round(low + (b[i] - low) * (at % 1)));
}

// Returns 256 colours as RGBA bytes in `bands` bands; 0 means a continuous scale.
export function ramp(colours, bands = 0) {
  const out = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; i += 1) {
    const share = bands > 1 ? Math.min(Math.floor((i * bands) / 256), bands - 1) / (bands - 1) : i / 255;
    out.set([...between(colours, share), 255], 4 * i);
  }
  return out;
}

const PARTS = 6; // Largest number of intervals of a colour bar.

// Returns [low, high, number]: round numbers around `low` and `high`, and the number of intervals between them.
export function rounded(low, high) {
  const span = Math.max(high - low, 1e-9 * Math.max(Math.abs(low), Math.abs(high)), 1e-30);
  const power = 10 ** Math.floor(Math.log10(span / 4));
  const step = power * ([1, 2, 2.5, 5, 10].find((factor) => span / (factor * power) <= PARTS + 1e-9) ?? 10);
  const first = Math.floor(low / step + 1e-9);
  const last = Math.max(Math.ceil(high / step - 1e-9), first + 1);
  return [first * step, last * step, last - first + 1];
}
