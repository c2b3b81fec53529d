// Arrows for the velocities of a few triangles that are spread evenly over the body (docs/snapshots.md).

const LONGEST = 0.09; // Length of the arrow of the largest speed, relative to the diagonal of the framed region.
const SIDES = 6;
// Radii of shaft and head, and length of the head, relative to the length of the arrow.
const [SHAFT, HEAD, TIP] = [0.014, 0.05, 0.26];
const MOST = 600; // Largest number of arrows, including those of mirror images.

export class Arrows {
  constructor(THREE) {
    this.three = THREE;
    this.material = new THREE.MeshBasicMaterial();
    this.mesh = new THREE.InstancedMesh(shape(THREE), this.material, MOST);
    Object.assign(this.mesh, { frustumCulled: false, visible: false, count: 0 });
  }

  // Draws the arrows and returns the largest speed, m/s. The function `keep(part, place)` selects the arrows; `reach`
  // is the size of the framed region, m.
  show(snapshot, { explode, middle, mirrors, keep, ink, reach }) {
    const { Matrix4, Quaternion, Vector3 } = this.three;
    const found = collect(snapshot, explode, middle, keep);
    const most = found.reduce((so, { speed }) => Math.max(so, speed), 0);
    const images = 2 ** mirrors.length;
    const step = Math.max(1, Math.ceil((found.length * images) / MOST));
    const [along, turn, matrix] = [new Vector3(0, 1, 0), new Quaternion(), new Matrix4()];
    const size = LONGEST * reach;
    let count = 0;
    for (let i = 0; i < found.length && most > 0; i += step) {
      for (let image = 0; image < images; image += 1) {
        const [place, way] = reflected(found[i], mirrors, image);
        const length = (size * found[i].speed) / most;
        if (!(length > 0.02 * size)) continue;
        turn.setFromUnitVectors(along, new Vector3(...way).normalize());
        matrix.compose(new Vector3(...place), turn, new Vector3(Math.max(length, size / 4), length, Math.max(length, size / 4)));
        this.mesh.setMatrixAt(count, matrix);
        count += 1;
      }
    }
    this.material.color.setRGB(...ink);
    Object.assign(this.mesh, { count, visible: count > 0 });
    this.mesh.instanceMatrix.needsUpdate = true;
    return most;
  }

  hide() { this.mesh.visible = false; }

  close() {
    this.mesh.geometry.dispose();
    this.material.dispose();
    this.mesh.dispose();
  }
}

function collect({ header: { box: [low, high] }, arrays }, explode, middle, keep) {
  const { arrow_triangle: which = [], arrow_velocity: velocities, triangles, positions, triangle_part: parts, vertex_fragment: rows, fragment_centre: centres } = arrays;
  const out = [];
  which.forEach?.((triangle, k) => {
    const at = (axis) => [0, 1, 2].reduce((sum, i) => sum + positions[3 * triangles[3 * triangle + i] + axis], 0) / 3;
    const place = [0, 1, 2].map((axis) => low[axis] + ((high[axis] - low[axis]) * at(axis)) / 65535);
    if (!keep(parts[triangle], place)) return;
    const row = rows[triangles[3 * triangle]];
    const way = [0, 1, 2].map((axis) => velocities[3 * k + axis]);
    out.push({ place: place.map((value, axis) => value + explode * (centres[3 * row + axis] - middle[axis])), way, speed: Math.hypot(...way) });
  });
  return out;
}

function reflected({ place, way }, mirrors, image) {
  const [at, along] = [[...place], [...way]];
  mirrors.forEach((plane, k) => {
    if (!((image >> k) & 1)) return;
    at[plane.axis] = 2 * plane.at - at[plane.axis];
    along[plane.axis] = -along[plane.axis];
  });
  return [at, along];
}

// Returns the geometry of an arrow of length 1 along y, with a shaft and a head.
function shape({ BufferGeometry, BufferAttribute }) {
  const out = [];
  const ring = (k, radius, y) => [radius * Math.cos((2 * Math.PI * k) / SIDES), y, radius * Math.sin((2 * Math.PI * k) / SIDES)];
  for (let k = 0; k < SIDES; k += 1) {
    const [a, b, c, d] = [ring(k, SHAFT, 0), ring(k + 1, SHAFT, 0), ring(k, SHAFT, 1 - TIP), ring(k + 1, SHAFT, 1 - TIP)];
    out.push(a, c, b, b, c, d, ring(k, HEAD, 1 - TIP), [0, 1, 0], ring(k + 1, HEAD, 1 - TIP));
    out.push([0, 1 - TIP, 0], ring(k, HEAD, 1 - TIP), ring(k + 1, HEAD, 1 - TIP));
  }
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(out.flat()), 3));
}
