// Decoding of a snapshot of the fragments: from bytes (docs/reference/snapshots.md) to the data of the view and of the
// tables.

const MAGIC = "CONOSNAP";
const VERSION = 1;
const START = 16;
const TYPES = {
  uint8: Uint8Array, uint16: Uint16Array, uint32: Uint32Array, int64: BigInt64Array, float32: Float32Array, float64: Float64Array,
};
const DUST = 10; // Smallest number of tets of a fragment that is not dust, as in conoid.cases.output.fragments.
// Largest number of rows of the table of fragments, because a vertex stores the number of its row in 16 bits.
const MOST_ROWS = 65536;

// Returns { header, arrays: { name: typed array, flat } } without copying data. Throws Error for other data.
export function decode(buffer) {
  const bytes = new DataView(buffer);
  if (buffer.byteLength < START || new TextDecoder().decode(new Uint8Array(buffer, 0, 8)) !== MAGIC) throw new Error("not a snapshot");
  if (bytes.getUint32(8, true) !== VERSION) throw new Error(`a snapshot of version ${bytes.getUint32(8, true)}; known: ${VERSION}`);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, START, bytes.getUint32(12, true))));
  const arrays = {};
  for (const [name, { dtype, shape, offset }] of Object.entries(header.arrays)) {
    arrays[name] = new TYPES[dtype](buffer, offset, shape.reduce((size, length) => size * length, 1));
  }
  if (arrays.fragment_id?.length > MOST_ROWS) throw new Error(`${arrays.fragment_id.length} rows of fragments; most: ${MOST_ROWS}`);
  return { header, arrays };
}

// Returns separate corners of all triangles (no shared vertices): x, y, z and the row of the fragment.
export function corners({ positions, triangles, vertex_fragment: rows }) {
  const out = new Uint16Array(4 * triangles.length);
  for (let i = 0, o = 0; i < triangles.length; i += 1) {
    const vertex = triangles[i];
    out[o++] = positions[3 * vertex];
    out[o++] = positions[3 * vertex + 1];
    out[o++] = positions[3 * vertex + 2];
    out[o++] = rows[vertex];
  }
  return out;
}

// Returns the colourings of the triangles: "fragment", "part", "rank" and the fields of this case.
export const colourings = ({ header }) => ["fragment", "part", ...(header.ranks > 1 ? ["rank"] : []), ...Object.keys(header.fields)];

// Returns the default colouring of a body. Bodies that do not break have one colour each, so that their plastic strain
// shows more.
export function telling({ header: { fields, fragments_total: number, parts } }) {
  const breaks = "broken_faces" in fields || number > parts.length;
  return !breaks && "plastic_strain" in fields ? "plastic_strain" : "fragment";
}

// Returns one byte for each corner: the number of the rank or part, or the value of a field relative to its range.
export function cornerValues({ arrays }, by) {
  const name = { rank: "triangle_rank", part: "triangle_part" }[by] ?? `field:${by}`;
  const values = arrays[name];
  const out = new Uint8Array(arrays.triangles.length);
  if (by === "fragment" || !values) return out;
  for (let i = 0, o = 0; i < values.length; i += 1) out[o++] = out[o++] = out[o++] = values[i];
  return out;
}

// Returns the names of the parts of each fragment, joined by " + "; a fragment without triangles has no name.
export function partsOf({ header, arrays }) {
  const found = Array.from({ length: arrays.fragment_id.length }, () => new Set());
  arrays.triangle_part?.forEach((part, i) => found[arrays.vertex_fragment[arrays.triangles[3 * i]]].add(header.parts[part]));
  return found.map((names) => [...names].join(" + "));
}

// Returns a row of the table of fragments in SI; `rest` is true if the row stands for all fragments without a row of
// their own.
export function fragment({ arrays }, row) {
  const vector = (name) => [0, 1, 2].map((axis) => arrays[name][3 * row + axis]);
  return {
    row, id: arrays.fragment_id[row], rest: arrays.fragment_id[row] < 0n, mass: arrays.fragment_mass[row], size: arrays.fragment_size[row],
    centre: vector("fragment_centre"), velocity: vector("fragment_velocity"), tets: arrays.fragment_tets[row], birth: arrays.fragment_birth[row],
  };
}

// Returns the row of a fragment in another snapshot of the run; -1 if the fragment does not exist there.
export const rowOf = ({ arrays }, id) => arrays.fragment_id.indexOf(id);

// Returns N(size), the number of fragments of at least a size, beginning with the smallest size, and the best fitting
// law. Fragments of fewer than DUST tets are left out, as in the tables of the run, because their shape is that of
// single tets.
export function sizes({ arrays }) {
  const whole = [...arrays.fragment_size].filter((size, row) => size > 0 && arrays.fragment_id[row] >= 0n && arrays.fragment_tets[row] >= DUST);
  const sorted = whole.sort((a, b) => a - b);
  const found = laws(sorted);
  const best = found.reduce((one, other) => (other.likelihood > (one?.likelihood ?? -Infinity) ? other : one), null);
  return { points: sorted.map((size, i) => [size, sorted.length - i]), dust: arrays.fragment_id.length - sorted.length, best };
}

// Fits a Rayleigh, an exponential and a power law to sizes by maximum likelihood (conoid.cases.output.fragments.fits).
// Returns, for each law, its parameter, the sum of ln(density), and the fraction of fragments that are longer than a
// size.
export function laws(values) {
  const [n, low, high] = [values.length, values[0], values.at(-1)];
  if (n < 2 || !(low > 0) || low === high) return [];
  const sum = (of) => values.reduce((total, x) => total + of(x), 0);
  const [mean, mode, above] = [sum((x) => x) / n, Math.sqrt(sum((x) => x * x) / (2 * n)), sum((x) => Math.log(x / low))];
  const exponent = 1 + n / above;
  return [
    { law: "rayleigh", parameter: mode, likelihood: sum(Math.log) - 2 * n * Math.log(mode) - n, longer: (x) => Math.exp(-(x * x) / (2 * mode * mode)) },
    { law: "exponential", parameter: mean, likelihood: -n * Math.log(mean) - n, longer: (x) => Math.exp(-x / mean) },
    { law: "power", parameter: exponent, likelihood: n * Math.log((exponent - 1) / low) - exponent * above, longer: (x) => (x / low) ** (1 - exponent) },
  ];
}
