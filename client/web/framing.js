// Region of a body that the camera frames, and the camera position from which the whole region is visible.

const HEAVY = 0.02; // A fragment with more than this fraction of the mass of its part is always framed.
// Fraction of the mass of a part: if fragments are sorted by mass, the fragments beyond this fraction are debris.
const ENOUGH = 0.9;
const INNER = [0.05, 0.95]; // Quantiles by mass between which debris is framed along each axis.
const MOST = 6000; // Largest number of points that describe the framed region.

// Returns the points (m, three numbers each) of the framed region: heavy fragments of every visible part completely,
// and the inner part of its debris if the debris has much of the mass. `all`: everything is framed; `shown(part)`:
// whether a part is visible; `only`: the only part to frame, or null.
export function points(snapshot, { all = false, only = null, shown = () => true } = {}) {
  const { arrays } = snapshot;
  const part = partOf(arrays);
  const wanted = (row) => part[row] !== 255 && shown(part[row]) && (only === null || part[row] === only);
  const chosen = all ? (row) => wanted(row) : heavy(arrays, part, wanted);
  const found = corners(snapshot, chosen);
  const debris = all ? [] : inner(arrays, part, (row) => wanted(row) && !chosen(row));
  return found.length + debris.length ? [...found, ...debris] : corners(snapshot, () => true);
}

// Returns the part of each row of the table of fragments, which is the part of its first triangle; 255 for rows that
// are not drawn.
export function partOf({ fragment_id: ids, triangles, vertex_fragment: rows, triangle_part: parts }) {
  const out = new Uint8Array(ids.length).fill(255);
  for (let i = parts.length - 1; i >= 0; i -= 1) out[rows[triangles[3 * i]]] = parts[i];
  return out;
}

// Returns true if a row is a heavy fragment of the wanted part.
function heavy({ fragment_mass: masses, fragment_id: ids }, part, wanted) {
  const total = new Float64Array(256);
  for (let row = 0; row < masses.length; row += 1) total[part[row]] += masses[row];
  return (row) => wanted(row) && ids[row] >= 0n && masses[row] >= HEAVY * total[part[row]];
}

// Returns the corners of the box of the inner debris of a part, if the mass of the debris is not small.
function inner({ fragment_mass: masses, fragment_centre: centres, fragment_id: ids }, part, light) {
  const out = [], total = new Float64Array(256), rows = new Map();
  for (let row = 0; row < masses.length; row += 1) {
    total[part[row]] += masses[row];
    if (light(row) && ids[row] >= 0n) rows.set(part[row], [...(rows.get(part[row]) ?? []), row]);
  }
  for (const [name, some] of rows) {
    const mass = some.reduce((sum, row) => sum + masses[row], 0);
    if (mass < (1 - ENOUGH) * total[name]) continue;
    const ends = [0, 1, 2].map((axis) => INNER.map((share) => quantile(some, (row) => centres[3 * row + axis], masses, share * mass)));
    for (let k = 0; k < 8; k += 1) out.push(ends[0][k & 1], ends[1][(k >> 1) & 1], ends[2][k >> 2]);
  }
  return out;
}

function quantile(rows, of, masses, most) {
  const sorted = [...rows].sort((a, b) => of(a) - of(b));
  let sum = 0;
  return of(sorted.find((row) => (sum += masses[row]) >= most) ?? sorted.at(-1));
}

function corners({ header: { box: [low, high] }, arrays: { positions, vertex_fragment: rows } }, chosen) {
  const [out, step] = [[], Math.max(1, Math.ceil(rows.length / MOST))];
  const scale = high.map((value, i) => (value - low[i]) / 65535);
  const ends = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity];
  const at = [0, 0, 0];
  for (let vertex = 0; vertex < rows.length; vertex += 1) {
    if (!chosen(rows[vertex])) continue;
    let extreme = vertex % step === 0;
    for (let axis = 0; axis < 3; axis += 1) {
      at[axis] = low[axis] + scale[axis] * positions[3 * vertex + axis];
      if (at[axis] < ends[axis]) [ends[axis], extreme] = [at[axis], true];
      if (at[axis] > ends[3 + axis]) [ends[3 + axis], extreme] = [at[axis], true];
    }
    if (extreme) out.push(at[0], at[1], at[2]);
  }
  return out;
}

// Returns the closest camera position, with the view along -`back`, from which all points are in view: { place, depth };
// `depth` is the distance to the middle of the points. `right`, `up`, `back`: unit vectors; `toLeft`, `toRight`,
// `tall`: tangents of the angles to the left, to the right, and of half of the height.
export function stand(list, { right, up, back }, [toLeft, toRight], tall) {
  const far = [-Infinity, -Infinity, -Infinity, -Infinity, Infinity, -Infinity];
  for (let i = 0; i < list.length; i += 3) {
    const [x, y, z] = [right, up, back].map((axis) => axis[0] * list[i] + axis[1] * list[i + 1] + axis[2] * list[i + 2]);
    const seen = [x + toRight * z, toLeft * z - x, y + tall * z, tall * z - y];
    for (let k = 0; k < 4; k += 1) far[k] = Math.max(far[k], seen[k]);
    far[4] = Math.min(far[4], z);
    far[5] = Math.max(far[5], z);
  }
  const away = Math.max((far[0] + far[1]) / (toLeft + toRight), (far[2] + far[3]) / (2 * tall));
  const [x, y] = [(far[0] - far[1] + (toLeft - toRight) * away) / 2, (far[2] - far[3]) / 2];
  const place = [0, 1, 2].map((i) => x * right[i] + y * up[i] + away * back[i]);
  return { place, depth: away - (far[4] + far[5]) / 2 };
}

// Returns the points together with their mirror images behind planes of symmetry, { axis, at } each.
export function mirrored(list, planes) {
  let out = list;
  for (const { axis, at } of planes) out = [...out, ...out.map((value, i) => (i % 3 === axis ? 2 * at - value : value))];
  return out;
}
