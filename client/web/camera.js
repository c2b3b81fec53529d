// The camera: it fits the framed region, follows a part or stays, turns to the axes, and can be shared by several
// views.

import { mirrored, points, stand } from "./framing.js";

const ANGLE = 30; // Vertical angle of view of the camera, degrees.
const MARGIN = 1.06; // Margin around the framed region, as a factor.
const TURN = Math.PI / 24; // Angle by which one press of an arrow key turns the camera.
const FREE = 0.16; // Fraction of the height of the view that is left free for axes and scale bar.
const LEGEND = [90, 0.2]; // Space at the right of the view for the legend: px, and largest fraction of the width.
const VIEWS = { "+x": [1, 0, 0], "-x": [-1, 0, 0], "+y": [0, 1, 0], "-y": [0, -1, 0], "+z": [0, 0, 1], "-z": [0, 0, -1] };

// Numbers of client/drawing/camera.py: the default direction to the camera, the component of this direction along the
// visible side, and the ratio of the largest to the second extent above which a body is long.
const [FROM, ASIDE, LONG] = [[1, -1.55, 0.62], 1.55, 2.2];
export const VIEW_NAMES = [...Object.keys(VIEWS), "isometric"];

export class ViewCamera {
  // `changed` is called when the picture must be redrawn. `framed` returns { snapshot, explode, mirrors, shown }, on
  // which the framed region depends.
  constructor({ THREE, OrbitControls }, canvas, changed, framed) {
    Object.assign(this, { three: THREE, framed, changed, mode: "fit", part: null, others: new Set() });
    this.camera = new THREE.PerspectiveCamera(ANGLE, 1, 1e-3, 10);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { enableDamping: false, zoomToCursor: true });
    this.controls.addEventListener("change", () => this.moved());
    this.controls.addEventListener("start", () => { this.touched = this.distance; this.held = true; });
    this.controls.addEventListener("end", () => { this.held = false; this.released(); });
    this.quiet = false;
    this.reserved = 0;
  }

  // Unit vector from the target to the camera.
  back() { return this.camera.position.clone().sub(this.controls.target).normalize().toArray(); }

  // Returns the extent of the framed region along a direction: [from, to], m.
  along(normal) {
    const list = this.list();
    const ends = [Infinity, -Infinity];
    for (let i = 0; i < list.length; i += 3) {
      const at = normal[0] * list[i] + normal[1] * list[i + 1] + normal[2] * list[i + 2];
      [ends[0], ends[1]] = [Math.min(ends[0], at), Math.max(ends[1], at)];
    }
    return ends;
  }

  // Returns the diagonal of the framed region, m.
  reach() { return Math.hypot(...[[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => this.along(axis)).map(([low, high]) => high - low)); }

  get distance() { return this.camera.position.distanceTo(this.controls.target); }

  moved() {
    this.changed();
    if (this.quiet) return;
    for (const other of this.others) other.copy(this);
  }

  // Turning keeps the framed region; zooming and shifting end the automatic framing.
  released() {
    const shifted = this.framedAt && this.controls.target.distanceTo(this.framedAt) > 1e-6 * this.distance;
    if (this.mode !== "free" && (shifted || Math.abs(this.distance / this.touched - 1) > 1e-3)) this.follow(this.mode === "part" ? "part" : "free", this.part);
    this.onMode?.();
  }

  // Sets what the camera frames: "fit", "all", "free", or "part" with the number of a part.
  follow(mode, part = null) {
    const before = [this.mode, this.part];
    Object.assign(this, { mode, part, home: null });
    if (mode === "part" && (before[0] !== "part" || before[1] !== part)) this.fit({ only: part });
    else if (mode === "fit" || mode === "all") this.fit();
  }

  // Updates the camera after a new snapshot or another change of the framed region.
  keep() {
    if (!this.direction) this.first();
    else if (this.mode === "fit" || this.mode === "all") this.fit();
    else if (this.mode === "part") this.carry();
  }

  // Sets the first view, which is the default view of pictures (client/drawing/camera.py).
  first() {
    const list = this.list();
    const sides = new Map(this.framed().cuts.map(({ axis, at }) => [axis, middle(list, axis) > at ? -1 : 1]));
    const { away, up, top } = firstView([0, 1, 2].map((axis) => extent(list, axis)), sides);
    this.look(away, up, top);
  }

  // Sets the view along a direction; the axis `up` points upwards (`top` = 1) or downwards (`top` = -1).
  look(away, up, top = 1) {
    this.direction = true;
    this.camera.up.set(0, 0, 0).setComponent(up, top);
    this.pole();
    this.camera.position.fromArray(away).normalize().add(this.controls.target);
    this.camera.lookAt(this.controls.target);
    this.fit(this.mode === "part" ? { only: this.part } : {});
  }

  // OrbitControls turn about the upward direction that the camera had when they were made; this function sets the
  // present upward direction.
  pole() {
    this.controls._quat.setFromUnitVectors(this.camera.up, new this.three.Vector3(0, 1, 0));
    this.controls._quatInverse.copy(this.controls._quat).invert();
  }

  // Selects one of the views in VIEW_NAMES.
  view(name) {
    const away = VIEWS[name] ?? [1, -1, 0.8];
    const up = VIEWS[name]?.[2] ? 1 : 2;
    if (this.mode === "free") this.mode = "fit";
    this.look(away, up);
    this.onMode?.();
  }

  // Returns the points of the framed regions of all views that share the camera.
  list(more = {}) {
    return [this, ...this.others].flatMap((eye) => eye.places({ all: this.mode === "all", ...more }));
  }

  places(more) {
    const { snapshot, mirrors, shown } = this.framed();
    if (!snapshot) return [];
    return mirrored(points(snapshot, { shown, ...more }), mirrors);
  }

  fit(more = {}) {
    const { camera, controls } = this;
    if (!this.framed().snapshot) return;
    camera.updateMatrixWorld();
    const [right, up, back] = [0, 1, 2].map((column) => new this.three.Vector3().setFromMatrixColumn(camera.matrixWorld, column).toArray());
    const half = Math.tan((camera.fov * Math.PI) / 360);
    const list = this.pulled(this.list(more));
    const wide = (half * camera.aspect) / MARGIN;
    const { place, depth } = stand(list, { right, up, back }, [wide, wide * (1 - 2 * this.reserved)], (half * (1 - FREE)) / MARGIN);
    camera.position.fromArray(place);
    controls.target.fromArray(place.map((value, i) => value - depth * back[i]));
    this.settle();
    this.framedAt = controls.target.clone();
    if (this.mode === "part") this.home = this.centre();
  }

  // Exploded fragments need more space in the view.
  pulled(list) {
    const { explode, snapshot: { header: { box } } } = this.framed();
    if (!explode) return list;
    return list.map((value, i) => value + explode * (value - (box[0][i % 3] + box[1][i % 3]) / 2));
  }

  // Follows the centre of mass of the selected part.
  carry() {
    const now = this.centre();
    if (!now || !this.home) return;
    const shift = now.clone().sub(this.home);
    this.camera.position.add(shift);
    this.controls.target.add(shift);
    this.home = now;
    this.settle();
  }

  centre() {
    const { snapshot } = this.framed();
    const list = points(snapshot, { only: this.part, shown: () => true });
    return new this.three.Vector3(...[0, 1, 2].map((axis) => middle(list, axis)));
  }

  settle() {
    const size = Math.hypot(...this.framed().snapshot.header.box[1].map((value, i) => value - this.framed().snapshot.header.box[0][i])) || 1;
    const far = this.distance + 20 * size;
    Object.assign(this.camera, { near: Math.max(this.distance / 200, far / 1e5), far });
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.moved();
  }

  aspect(width, height) {
    this.reserved = Math.min(LEGEND[0] / width, LEGEND[1]);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.framed().snapshot && this.direction && (this.mode === "fit" || this.mode === "all")) this.fit();
  }

  // Handles a key that turns, shifts (with Shift) or zooms the camera; returns false for any other key.
  key(name, shift) {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (moves[name] && shift) this.shift(...moves[name]);
    else if (moves[name]) this.turn(moves[name][0] * TURN, moves[name][1] * TURN, 1);
    else if (name === "+" || name === "=") this.turn(0, 0, 0.9);
    else if (name === "-") this.turn(0, 0, 1 / 0.9);
    else return false;
    return true;
  }

  turn(about, over, nearer) {
    const { Spherical, Vector3, Quaternion } = this.three;
    const level = new Quaternion().setFromUnitVectors(this.camera.up, new Vector3(0, 1, 0));
    const away = this.camera.position.clone().sub(this.controls.target).applyQuaternion(level);
    const place = new Spherical().setFromVector3(away);
    place.set(place.radius * nearer, place.phi + over, place.theta + about).makeSafe();
    this.camera.position.copy(away.setFromSpherical(place).applyQuaternion(level.invert()).add(this.controls.target));
    if (nearer !== 1 && this.mode !== "part") this.mode = "free";
    this.controls.update();
    this.onMode?.();
  }

  shift(right, down) {
    const step = this.distance / 15;
    const way = new this.three.Vector3(right * step, -down * step, 0).applyQuaternion(this.camera.quaternion);
    this.camera.position.add(way);
    this.controls.target.add(way);
    if (this.mode !== "part") this.mode = "free";
    this.controls.update();
    this.onMode?.();
  }

  // Copies the view of another camera; `share` uses this function to couple several views.
  copy(other) {
    this.quiet = true;
    this.direction = true;
    for (const name of ["position", "up", "quaternion"]) this.camera[name].copy(other.camera[name]);
    this.pole();
    this.controls.target.copy(other.controls.target);
    Object.assign(this.camera, { near: other.camera.near, far: other.camera.far });
    Object.assign(this, { mode: "free" });
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.changed();
    this.quiet = false;
  }
}

// Returns the direction to the camera { away } and the axis that points upwards { up }, for a body with the extents
// `side` along x, y and z, m. A long body lies horizontally. Planes of symmetry face the camera: `sides` maps an axis
// to its visible side, -1 or 1.
export function firstView(side, sides) {
  const [second, longest] = [0, 1, 2].sort((a, b) => side[a] - side[b]).slice(1);
  if (side[longest] > LONG * side[second]) return beside(longest, sides);
  if (!sides.has(0) && !sides.has(1)) return { away: FROM, up: 2, top: 1 };
  const [x, y] = [sides.get(0) ?? 0.8, sides.get(1) ?? -0.8];
  return { away: [x * (sides.has(1) ? 1 : ASIDE), y * (sides.has(0) ? 1 : ASIDE), FROM[2]], up: 2, top: 1 };
}

function beside(along, sides) {
  const [x, y] = [sides.get(0) ?? sides.get(1) ?? -1, sides.get(1) ?? -(sides.get(0) ?? -1)];
  const faces = along < 2 ? [1 - along, 2, sides.get(1 - along) ?? (along ? 1 : -1), 1] : x * y < 0 ? [0, 1, x, y] : [1, 0, y, x];
  const [shown, up, face, top] = faces;
  const away = [0, 0, 0];
  [away[shown], away[up], away[along]] = [ASIDE * face, 0.5 * top, 0.45 * (sides.get(along) ?? 1)];
  return { away, up, top };
}

// Couples several views, each { eye }, so that all move together. The framed region is that of the first view.
export function share(views) {
  for (const { eye } of views) eye.others = new Set(views.map((other) => other.eye).filter((other) => other !== eye));
  if (views[0]?.eye.direction) views[0].eye.moved();
}

const each = (list, axis) => list.filter((_, i) => i % 3 === axis);
const bounds = (list, axis) => each(list, axis).reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
const extent = (list, axis) => bounds(list, axis)[1] - bounds(list, axis)[0];
const middle = (list, axis) => (bounds(list, axis)[0] + bounds(list, axis)[1]) / 2;
