// Section through a body: the polygons in which a plane cuts the tets of a snapshot (docs/snapshots.md).

import { decode } from "./snapshot.js";

// Returns { header, arrays, tets } from the file of all tets; `tets` (4 n) are the nodes of the tets. Throws Error for
// other data.
export async function unpack(buffer) {
  const stream = new Blob([buffer]).stream().pipeThrough(new DecompressionStream("gzip"));
  const found = decode(await new Response(stream).arrayBuffer());
  return { ...found, tets: nodes(found.arrays.tet_steps) };
}

// Decodes node numbers that are stored as differences, byte by byte.
export function nodes(steps) {
  const n = steps.length / 16;
  const out = new Int32Array(4 * n);
  for (let i = 0, first = 0; i < n; i += 1) {
    for (let k = 0, node = 0; k < 4; k += 1) {
      const at = k * n + i;
      node += steps[at] | (steps[4 * n + at] << 8) | (steps[8 * n + at] << 16) | (steps[12 * n + at] << 24);
      if (k === 0) node = first += node;
      out[4 * i + k] = node;
    }
  }
  return out;
}

// Smallest distance of a section from the end of the tets along the normal, relative to the extent of the tets.
const INSET = 0.02;

// Returns the position (m) along `normal` next to `middle` that lies inside of the tets, whose box is given. In a half
// or quarter model, the middle of the body with its mirror images is the plane of symmetry, where the tets end.
export function within(middle, [low, high], normal) {
  const ends = [false, true].map((far) => normal.reduce((sum, part, i) => sum + part * ((part < 0) === far ? low[i] : high[i]), 0));
  const inset = INSET * (ends[1] - ends[0]);
  return Math.min(ends[1] - inset, Math.max(ends[0] + inset, middle));
}

// Returns { corners, tet, omit }: triangles in the plane `normal` · x = `at` (m), stored like those of a surface with
// x, y, z and row of each corner. `tet` is the tet of each triangle; `omit` is the edge of the triangle that is not an
// edge of the section of the tet.
export function cut(volume, normal, at) {
  const distance = distances(volume, normal, at);
  const { tets } = volume;
  const crossed = crossing(tets, distance);
  const { arrays: { positions, tet_row: rows } } = volume;
  const out = { corners: new Uint16Array(12 * crossed.triangles), tet: new Uint32Array(crossed.triangles), omit: new Uint8Array(crossed.triangles) };
  const point = new Uint16Array(12); // Up to four corners of a polygon, three numbers each.
  let made = 0;
  for (const tet of crossed.tets) {
    const number = polygon(point, positions, tets, tet, distance);
    for (let k = 2; k < number; k += 1, made += 1) {
      corner(out.corners, 12 * made, point, 0, rows[tet]);
      corner(out.corners, 12 * made + 4, point, k - 1, rows[tet]);
      corner(out.corners, 12 * made + 8, point, k, rows[tet]);
      out.tet[made] = tet;
      // 1: the edge from the last corner to the first; 2: the edge from the first corner to the second.
      out.omit[made] = number === 4 ? k - 1 : 0;
    }
  }
  return out;
}

// Returns the signed distance of each node from the plane, in any unit; the distance is never 0.
function distances({ header: { box: [low, high] }, arrays: { positions } }, normal, at) {
  const [a, b, c] = normal.map((part, i) => (part * (high[i] - low[i])) / 65535);
  const start = normal[0] * low[0] + normal[1] * low[1] + normal[2] * low[2] - at;
  const least = 1e-9 * (Math.abs(a) + Math.abs(b) + Math.abs(c)) * 65535;
  const out = new Float32Array(positions.length / 3);
  for (let i = 0, p = 0; i < out.length; i += 1, p += 3) {
    out[i] = start + a * positions[p] + b * positions[p + 1] + c * positions[p + 2] || least;
  }
  return out;
}

function crossing(tets, distance) {
  const found = [];
  let triangles = 0;
  for (let i = 0; i < tets.length; i += 4) {
    const above = (distance[tets[i]] > 0) + (distance[tets[i + 1]] > 0) + (distance[tets[i + 2]] > 0) + (distance[tets[i + 3]] > 0);
    if (above === 0 || above === 4) continue;
    found.push(i / 4);
    triangles += above === 2 ? 2 : 1;
  }
  return { tets: found, triangles };
}

// Writes the corners of the polygon in order to `point`; returns the number of corners.
function polygon(point, positions, tets, tet, distance) {
  const above = [], below = [];
  for (let k = 0; k < 4; k += 1) (distance[tets[4 * tet + k]] > 0 ? above : below).push(tets[4 * tet + k]);
  const pairs = above.length === 2 ? [[0, 0], [0, 1], [1, 1], [1, 0]] : above.length === 1 ? [[0, 0], [0, 1], [0, 2]] : [[0, 0], [1, 0], [2, 0]];
  pairs.forEach(([i, j], k) => between(point, 3 * k, positions, above[i], below[j], distance));
  return pairs.length;
}

function between(point, to, positions, one, other, distance) {
  const share = distance[one] / (distance[one] - distance[other]);
  for (let axis = 0; axis < 3; axis += 1) {
    const from = positions[3 * one + axis];
    point[to + axis] = Math.round(from + share * (positions[3 * other + axis] - from));
  }
}

function corner(out, to, point, number, row) {
  out[to] = point[3 * number];
  out[to + 1] = point[3 * number + 1];
  out[to + 2] = point[3 * number + 2];
  out[to + 3] = row;
}

// Returns one byte for each corner of a section: the value of a field relative to its range, or the part.
export function cutValues({ arrays }, { tet }, by) {
  const values = by === "part" ? arrays.tet_part : arrays[`field:${by}`];
  const out = new Uint8Array(3 * tet.length);
  if (values) for (let i = 0; i < tet.length; i += 1) out.fill(values[tet[i]], 3 * i, 3 * i + 3);
  return out;
}
