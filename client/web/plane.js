// Plane of a section, chosen with the tools of the 3-D view: direction, position, and the side that is cut away.

import { within } from "./section.js";

const BESIDE = 0.02; // Distance of the first section from a plane of symmetry, as a fraction of the extent of the body.
const AXES = ["x", "y", "z"];
const ALONG = 0.99; // Smallest cosine between the line of sight and the normal for a view across the section.
export const HOLLOW = "this snapshot has no file of all tets, so its section is not filled";

export class SectionPlane {
  constructor(tools) {
    Object.assign(this, { tools, on: false });
  }

  // Moves the plane close to a plane of symmetry with this normal or, without one, to the middle of the region that a camera
  // frames; `box` is the box of all tets. The side towards the camera is cut away.
  choose(eye, box) {
    const { tools } = this;
    const name = tools.across.value;
    this.on = name !== "none";
    if (!this.on) return tools.tell(null, "");
    const way = eye.back();
    const axis = AXES.indexOf(name);
    this.normal = axis < 0 ? way : [0, 1, 2].map((i) => (i === axis ? 1 : 0));
    tools.flipped = axis >= 0 && way[axis] < 0;
    const along = eye.along(this.normal);
    const mirror = eye.framed().cuts.find((one) => one.axis === axis);
    const far = mirror && (mirror.at > (along[0] + along[1]) / 2 ? along[0] : along[1]);
    return tools.slide(...along, within(mirror ? mirror.at + BESIDE * (far - mirror.at) : (along[0] + along[1]) / 2, box, this.normal));
  }

  // Cuts away the side towards the camera if the line of sight is across the section. Returns true if the side has
  // changed.
  face(eye) {
    const axis = AXES.indexOf(this.tools.across.value);
    const way = eye.back()[axis];
    if (!this.on || axis < 0 || Math.abs(way) < ALONG || this.tools.flipped === way < 0) return false;
    this.tools.flipped = way < 0;
    return true;
  }

  // Returns { normal, at } for View3d.slice, or null without a section.
  get value() {
    if (!this.on) return null;
    const sign = this.tools.flipped ? -1 : 1;
    return { normal: this.normal.map((part) => sign * part), at: sign * this.tools.at };
  }

  // Writes the position of the plane beside the slider; `filled`: whether all tets are available.
  tell(filled) {
    if (this.on) this.tools.tell(this.tools.at, filled ? "" : HOLLOW);
  }
}

// Returns the planes of symmetry on whose positive side all parts lie, { axis, at }, at most one for each axis.
export function symmetry(plan) {
  const found = (plan?.boundaries ?? []).filter(({ kind, parts }) => kind === "symmetry" && !parts?.length);
  return AXES.map((name, axis) => ({ axis, at: found.find((one) => one.axis === name)?.at })).filter(({ at }) => at !== undefined);
}
