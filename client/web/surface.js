// Meshes that show a snapshot: one mesh for all fragments and their mirror images, and meshes for the sections.

import { ofFragment, ofName } from "./colours.js";
import { partOf } from "./framing.js";
import { UNIFORM, ramp, scaleOf } from "./scales.js";
import { cut, cutValues } from "./section.js";
import { FRAGMENT, MOST_PARTS, ROWS_WIDTH, VERTEX } from "./shaders.js";
import { cornerValues, corners } from "./snapshot.js";

export const OPEN = 1e30; // Position of a section plane that cuts nothing away, m.
const LAYERS = ["solid", "depth", "colour"];

export class Surface {
  constructor(THREE) {
    this.three = THREE;
    this.scene = new THREE.Scene();
    const { Vector2, Vector3, Vector4, Color } = THREE;
    const texture = this.texture(new Uint8Array(4), 1, 1);
    this.shared = {
      low: { value: new Vector3() }, span: { value: new Vector3(1, 1, 1) }, middle: { value: new Vector3() }, explode: { value: 0 },
      mirrors: { value: [0, 1, 2].map(() => new Vector4()) }, layer: { value: -1 }, edges: { value: 0 }, planes: { value: 0 }, thin: { value: 0 }, ink: { value: new Color(0, 0, 0) },
      plane: { value: new Vector4(0, 0, 0, OPEN) }, centres: { value: texture }, tints: { value: texture }, map: { value: texture },
      shown: { value: this.texture(new Uint8Array(4 * MOST_PARTS).fill(255), MOST_PARTS, 1) },
    };
    this.own = { mode: { value: 0 }, range: { value: new Vector2(1, 0) }, cap: { value: 0 } };
    this.capOwn = { mode: { value: 0 }, range: { value: new Vector2(1, 0) }, cap: { value: 1 } };
    this.body = this.mesh({ ...this.own, image: { value: 0 } });
    this.caps = [];
    this.opacity = [];
  }

  // Returns a mesh with one material for each layer; the materials share their uniforms.
  mesh(own) {
    const { InstancedBufferGeometry, Mesh, RawShaderMaterial, DoubleSide, GLSL3 } = this.three;
    const more = { solid: {}, depth: { colorWrite: false }, colour: { transparent: true } };
    const materials = Object.fromEntries(LAYERS.map((name) => [name, new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: DoubleSide, uniforms: { ...this.shared, ...own }, ...more[name],
    })]));
    const mesh = new Mesh(new InstancedBufferGeometry(), materials.solid);
    Object.assign(mesh, { frustumCulled: false, userData: { materials, own } });
    this.scene.add(mesh);
    return mesh;
  }

  texture(data, width, height) {
    const { DataTexture, FloatType, NearestFilter, RGBAFormat, UnsignedByteType } = this.three;
    const made = new DataTexture(data, width, height, RGBAFormat, data instanceof Float32Array ? FloatType : UnsignedByteType);
    return Object.assign(made, { minFilter: NearestFilter, magFilter: NearestFilter, needsUpdate: true });
  }

  replace(name, texture) {
    this.shared[name].value.dispose();
    this.shared[name].value = texture;
  }

  // Drawing state -----------------------------------------------------------------------------------------------------------

  show(snapshot) {
    const [low, high] = snapshot.header.box;
    this.snapshot = snapshot;
    this.volume = null;
    this.shared.low.value.fromArray(low);
    this.shared.span.value.fromArray(high.map((value, i) => value - low[i]));
    this.fill(this.body, corners(snapshot.arrays));
    this.attribute(this.body, "part", cornerValues(snapshot, "part"));
    this.rows(snapshot);
    this.reflect(this.planes ?? []);
  }

  fill(mesh, places) {
    const { BufferAttribute, InstancedBufferGeometry } = this.three;
    const before = mesh.geometry.instanceCount;
    mesh.geometry.dispose();
    mesh.geometry = new InstancedBufferGeometry();
    mesh.geometry.instanceCount = before;
    mesh.geometry.setAttribute("corner", new BufferAttribute(places, 4));
    mesh.geometry.setDrawRange(0, places.length / 4);
  }

  attribute(mesh, name, values, share = false) {
    mesh.geometry.setAttribute(name, new this.three.BufferAttribute(values, 1, share));
  }

  rows({ arrays, header }) {
    const { fragment_centre: centres, fragment_id: ids } = arrays;
    const part = partOf(arrays);
    const height = Math.max(1, Math.ceil(ids.length / ROWS_WIDTH));
    const places = new Float32Array(4 * ROWS_WIDTH * height);
    const tints = new Uint8Array(4 * ROWS_WIDTH * height);
    for (let row = 0; row < ids.length; row += 1) {
      places.set(centres.subarray(3 * row, 3 * row + 3), 4 * row);
      tints.set([...ofFragment(ids[row], part[row], header.parts.length), 255], 4 * row);
    }
    this.replace("centres", this.texture(places, ROWS_WIDTH, height));
    this.replace("tints", this.texture(tints, ROWS_WIDTH, height));
  }

  // Sets the colouring; `range` { low, high } is the scale of a field, `bands` the number of its bands.
  colour(by, range, bands) {
    Object.assign(this, { by, range, bands });
    const field = this.snapshot.header.fields[by];
    this.attribute(this.body, "value", cornerValues(this.snapshot, by), true);
    this.own.mode.value = by === "fragment" ? 0 : 1;
    this.replace("map", this.texture(field ? ramp(range.uniform ? UNIFORM : scaleOf(by).colours, bands) : names(), 256, 1));
    scaled(this.own.range.value, field, range);
    this.tintCaps();
  }

  opacities(list) {
    this.opacity = list;
    const bytes = this.shared.shown.value.image.data.fill(255);
    list.forEach((share, part) => { bytes[4 * part] = Math.round(255 * share); });
    this.shared.shown.value.needsUpdate = true;
  }

  // Sets the planes of mirror images, { axis, at } each. Fragments explode from a middle on these planes.
  reflect(planes) {
    this.planes = planes;
    const [low, high] = this.snapshot.header.box;
    planes.forEach(({ axis, at }, k) => this.shared.mirrors.value[k].set(0, 0, 0, at).setComponent(axis, 1));
    this.shared.middle.value.fromArray(low.map((value, axis) => planes.find((plane) => plane.axis === axis)?.at ?? (value + high[axis]) / 2));
    this.shared.planes.value = planes.length;
    this.shared.thin.value = (1.5 * Math.max(...high.map((value, axis) => value - low[axis]))) / 65535;
    this.body.geometry.instanceCount = 2 ** planes.length;
  }

  // Sections ------------------------------------------------------------------------------------------------------------

  // Sets the section { normal, at }, or null; the material beyond the plane is cut away. Without all tets, or with
  // null, the section is not filled.
  slice(section) {
    this.section = section;
    if (section) this.shared.plane.value.set(...section.normal, section.at);
    else this.shared.plane.value.set(0, 0, 0, OPEN);
    this.cutAll();
  }

  cutAll() {
    const made = this.section && this.volume ? this.images() : [];
    while (this.caps.length < made.length) this.caps.push(this.mesh({ ...this.capOwn, image: { value: 0 } }));
    this.caps.forEach((cap, image) => {
      cap.visible = image < made.length;
      if (!cap.visible) return;
      cap.userData.own.image.value = image;
      cap.userData.found = made[image];
      this.fill(cap, made[image].corners);
      this.attribute(cap, "part", cutValues(this.volume, made[image], "part"));
      this.attribute(cap, "omit", thrice(made[image].omit));
      cap.geometry.instanceCount = 1;
    });
    this.tintCaps();
  }

  // Makes the filled section for each image, at the position of the body itself; images with equal sections share it.
  images() {
    const known = new Map();
    return Array.from({ length: 2 ** this.planes.length }, (_, image) => {
      const [normal, at] = this.local(image);
      const key = [...normal, at].join();
      if (!known.has(key)) known.set(key, cut(this.volume, normal, at));
      return known.get(key);
    });
  }

  local(image) {
    let { at } = this.section;
    const normal = [...this.section.normal];
    this.planes.forEach((plane, k) => {
      if (!((image >> k) & 1)) return;
      at -= 2 * plane.at * normal[plane.axis];
      normal[plane.axis] = -normal[plane.axis] + 0;
    });
    return [normal, at];
  }

  tintCaps() {
    const field = this.volume?.header.fields[this.by];
    this.capOwn.mode.value = field || this.by === "part" ? 1 : 0;
    scaled(this.capOwn.range.value, field, this.range);
    for (const cap of this.caps.filter(({ visible }) => visible)) this.attribute(cap, "value", cutValues(this.volume, cap.userData.found, this.by), true);
  }

  // Passes --------------------------------------------------------------------------------------------------------------

  // Draws the opaque parts, then each transparent part, the farthest first. Of a transparent part only its nearest
  // surface is drawn, over what is behind it.
  draw(renderer, camera) {
    this.pass(renderer, camera, "solid", -1);
    for (const part of this.ghosts(camera)) {
      this.pass(renderer, camera, "depth", part);
      this.pass(renderer, camera, "colour", part);
    }
  }

  pass(renderer, camera, layer, part) {
    this.shared.layer.value = part;
    for (const mesh of [this.body, ...this.caps]) mesh.material = mesh.userData.materials[layer];
    renderer.render(this.scene, camera);
  }

  ghosts(camera) {
    const clear = this.opacity.map((share, part) => [share, part]).filter(([share]) => share > 0.005 && share <= 0.995).map(([, part]) => part);
    if (clear.length < 2) return clear;
    const away = new Map(clear.map((part) => [part, camera.position.distanceTo(this.middleOf(part))]));
    return clear.sort((a, b) => away.get(b) - away.get(a));
  }

  middleOf(part) {
    const { arrays: { fragment_centre: centres, fragment_mass: masses } } = this.snapshot;
    const of = partOf(this.snapshot.arrays);
    const heaviest = masses.reduce((best, mass, row) => (of[row] === part && !(mass <= masses[best] && of[best] === part) ? row : best), 0);
    return new this.three.Vector3(...centres.subarray(3 * heaviest, 3 * heaviest + 3));
  }

  // Draws the number of the fragment's row at each pixel.
  numbers(renderer, camera, layers = [-1]) {
    const before = [this.own.mode.value, this.capOwn.mode.value];
    this.own.mode.value = this.capOwn.mode.value = 2;
    for (const part of layers) this.pass(renderer, camera, "solid", part);
    [this.own.mode.value, this.capOwn.mode.value] = before;
  }

  close() {
    for (const mesh of [this.body, ...this.caps]) {
      mesh.geometry.dispose();
      for (const material of Object.values(mesh.userData.materials)) material.dispose();
    }
    for (const { value } of [this.shared.centres, this.shared.tints, this.shared.map, this.shared.shown]) value.dispose();
  }
}

function scaled(range, field, { low, high } = {}) {
  if (!field) return range.set(255 / 256, 0.5 / 256); // Points to the middle of the texel of the number.
  const width = high - low || 1;
  return range.set((field.high - field.low) / width, (field.low - low) / width);
}

function names() {
  const out = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; i += 1) out.set([...ofName(i), 255], 4 * i);
  return out;
}

function thrice(values) {
  const out = new Uint8Array(3 * values.length);
  for (let i = 0, o = 0; i < values.length; i += 1) out[o++] = out[o++] = out[o++] = values[i];
  return out;
}
