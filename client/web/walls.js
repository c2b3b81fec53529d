// Rigid walls in the 3-D view: a disk for a plane, the side of a cylinder, a sphere. The shape of a wall comes from the
// case, its position from the snapshot.

export const WALL = "#8fa0b3"; // Colour of a wall.
// Opacity of a wall, so that a wall in front of the body does not hide the body.
const OPACITY = { plane: 0.24, round: 0.3 };
// Radius of a disk, and half of the length of a cylinder, relative to half of the diagonal of the body.
const WIDER = 1.35;

// Returns the walls of a case with all defaults: { shape, point, along, radius, moves } each.
export function wallsOf(plan) {
  return (plan?.boundaries ?? []).filter(({ kind }) => kind === "wall").map(({ shape, point, normal, axis, radius, velocity, mass }) => (
    { shape: shape ?? "plane", point, along: normal ?? axis ?? [0, 0, 1], radius: radius ?? 0, moves: mass != null || (velocity ?? []).some(Boolean) }));
}

// Returns { centre, along, radius, length }, m, of a wall in a snapshot; null for a wall whose position is not known.
export function placed(wall, place, [low, high]) {
  if (wall.moves && !place) return null;
  const size = Math.hypot(...wall.along);
  const along = wall.along.map((part) => part / size);
  const point = place ?? wall.point;
  const middle = low.map((value, i) => (value + high[i]) / 2);
  const reach = WIDER * Math.hypot(...low.map((value, i) => high[i] - value)) / 2;
  const height = along.reduce((sum, part, i) => sum + part * (middle[i] - point[i]), 0);
  if (wall.shape === "sphere") return { centre: point, along, radius: wall.radius, length: wall.radius };
  if (wall.shape === "cylinder") return { centre: point.map((value, i) => value + height * along[i]), along, radius: wall.radius, length: 2 * reach };
  return { centre: middle.map((value, i) => value - height * along[i]), along, radius: reach, length: 1 };
}

export class Walls {
  constructor(THREE) {
    const { Group, DoubleSide, MeshBasicMaterial, MeshLambertMaterial, HemisphereLight } = THREE;
    this.three = THREE;
    this.group = new Group();
    this.list = [];
    const look = { color: WALL, transparent: true, depthWrite: false, side: DoubleSide };
    this.materials = { plane: new MeshBasicMaterial({ ...look, opacity: OPACITY.plane }), round: new MeshLambertMaterial({ ...look, opacity: OPACITY.round }) };
    this.light = new HemisphereLight(0xffffff, 0x606a76, 3);
  }

  // Takes the walls of a case from wallsOf.
  take(list) {
    const { CircleGeometry, CylinderGeometry, Mesh, SphereGeometry } = this.three;
    this.clear();
    this.list = list;
    const shapes = { plane: () => new CircleGeometry(1, 96), cylinder: () => new CylinderGeometry(1, 1, 1, 96, 1, true), sphere: () => new SphereGeometry(1, 64, 32) };
    for (const { shape } of list) this.group.add(new Mesh(shapes[shape](), this.materials[shape === "plane" ? "plane" : "round"]));
    if (list.length) this.group.add(this.light);
  }

  // Moves the walls to their positions in a snapshot.
  show({ header: { box, walls = [] } }) {
    const { Vector3 } = this.three;
    this.list.forEach((wall, k) => {
      const [mesh, at] = [this.group.children[k], placed(wall, walls[k], box)];
      mesh.visible = at !== null;
      if (!at) return;
      const flat = wall.shape === "plane";
      mesh.position.set(...at.centre);
      mesh.quaternion.setFromUnitVectors(new Vector3(0, flat ? 0 : 1, flat ? 1 : 0), new Vector3(...at.along));
      mesh.scale.set(at.radius, flat ? at.radius : at.length, flat ? 1 : at.radius);
    });
  }

  get seen() { return this.group.visible && this.list.length > 0; }

  clear() {
    for (const mesh of [...this.group.children]) {
      mesh.geometry?.dispose();
      this.group.remove(mesh);
    }
  }

  close() {
    this.clear();
    for (const one of Object.values(this.materials)) one.dispose();
  }
}
