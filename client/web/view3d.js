// The body in 3-D: one draw call, whatever the number of fragments; frames are drawn when something has changed.

import { map, ofFragment } from "./colours.js";
import { FRAGMENT, ROWS_WIDTH, VERTEX } from "./shaders.js";
import { cornerValues, corners } from "./snapshot.js";

const OPEN = 1e30; // A section plane that cuts nothing, m.
const MARGIN = 1.15; // Of the distance at which the box just fills the canvas.
const TURN = Math.PI / 24; // Of one arrow key.

export class View3d {
  // `modules` is what libraries.three() gives; `onPick` gets the row of a fragment, or -1.
  constructor({ THREE, OrbitControls }, onPick) {
    this.three = THREE;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.canvas = this.renderer.domElement;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35, 1, 1e-3, 10);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.later());
    this.controls.addEventListener("start", () => { this.moved = true; });
    this.target = new THREE.WebGLRenderTarget(1, 1);
    this.material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: THREE.DoubleSide, uniforms: this.uniforms(),
    });
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), this.material);
    this.mesh.frustumCulled = false;
    this.scene.add(this.mesh);
    this.pickable(onPick);
    this.watch = new ResizeObserver(() => this.resize());
    this.watch.observe(this.canvas);
  }

  uniforms() {
    const { Vector2, Vector3, Vector4 } = this.three;
    const texture = this.texture(new Uint8Array(4), 1, 1);
    return {
      low: { value: new Vector3() }, span: { value: new Vector3(1, 1, 1) }, middle: { value: new Vector3() }, explode: { value: 0 },
      picked: { value: -1 }, mode: { value: 0 }, plane: { value: new Vector4(0, 0, 0, OPEN) }, range: { value: new Vector2(1, 0) },
      centres: { value: texture }, tints: { value: texture }, map: { value: texture },
    };
  }

  texture(data, width, height) {
    const { DataTexture, FloatType, NearestFilter, RGBAFormat, UnsignedByteType } = this.three;
    const type = data instanceof Float32Array ? FloatType : UnsignedByteType;
    const made = new DataTexture(data, width, height, RGBAFormat, type);
    Object.assign(made, { minFilter: NearestFilter, magFilter: NearestFilter, needsUpdate: true });
    return made;
  }

  replace(name, texture) {
    this.material.uniforms[name].value.dispose();
    this.material.uniforms[name].value = texture;
  }

  // What is shown -------------------------------------------------------------------------------------------------------

  show(snapshot) {
    const { BufferAttribute, BufferGeometry } = this.three;
    const [low, high] = snapshot.header.box;
    const { uniforms } = this.material;
    this.snapshot = snapshot;
    this.mesh.geometry.dispose();
    this.mesh.geometry = new BufferGeometry();
    this.mesh.geometry.setAttribute("corner", new BufferAttribute(corners(snapshot.arrays), 4));
    this.mesh.geometry.setDrawRange(0, snapshot.arrays.triangles.length);
    uniforms.low.value.fromArray(low);
    uniforms.span.value.fromArray(high.map((value, i) => value - low[i]));
    uniforms.middle.value.fromArray(high.map((value, i) => (value + low[i]) / 2));
    this.rows(snapshot.arrays, snapshot.header.parts.length);
    this.colour(this.by ?? "fragment", this.scale);
    if (!this.aimed) this.aim();
  }

  rows({ fragment_centre: centres, fragment_id: ids, triangles, triangle_part: parts, vertex_fragment: of }, bodies) {
    const part = new Uint8Array(ids.length);
    for (let i = parts.length - 1; i >= 0; i -= 1) part[of[triangles[3 * i]]] = parts[i];
    const height = Math.max(1, Math.ceil(ids.length / ROWS_WIDTH));
    const places = new Float32Array(4 * ROWS_WIDTH * height);
    const tints = new Uint8Array(4 * ROWS_WIDTH * height);
    for (let row = 0; row < ids.length; row += 1) {
      places.set(centres.subarray(3 * row, 3 * row + 3), 4 * row);
      tints.set([...ofFragment(ids[row], part[row], bodies), 255], 4 * row);
    }
    this.replace("centres", this.texture(places, ROWS_WIDTH, height));
    this.replace("tints", this.texture(tints, ROWS_WIDTH, height));
  }

  // `scale` is [low, high] of the colour map for a field; without it the values are numbers.
  colour(by, scale) {
    Object.assign(this, { by, scale });
    const field = this.snapshot.header.fields[by];
    const { uniforms } = this.material;
    const values = new this.three.BufferAttribute(cornerValues(this.snapshot, by), 1, true);
    this.mesh.geometry.setAttribute("value", values);
    uniforms.mode.value = by === "fragment" ? 0 : 1;
    this.replace("map", this.texture(map(Boolean(field)), 256, 1));
    const [low, high] = field ? scale ?? [field.low, field.high] : [0, 1];
    const width = high - low || 1;
    if (field) uniforms.range.value.set((field.high - field.low) / width, (field.low - low) / width);
    else uniforms.range.value.set(255 / 256, 0.5 / 256); // The middle of the number's texel.
    this.later();
  }

  set(name, value) {
    this.material.uniforms[name].value = value;
    this.later();
  }

  // Cuts away what lies beyond `share` (0 to 1) of the box along an axis (0, 1, 2); null: nothing.
  section(axis, share) {
    const { low, span, plane } = this.material.uniforms;
    plane.value.set(0, 0, 0, OPEN);
    if (axis !== null) {
      plane.value.setComponent(axis, 1);
      plane.value.w = low.value.getComponent(axis) + share * span.value.getComponent(axis);
    }
    this.later();
  }

  // The camera ----------------------------------------------------------------------------------------------------------

  // Looks at the whole box, its longest side from left to right.
  aim() {
    const { low, span } = this.material.uniforms;
    const size = span.value.length();
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    const sides = span.value.toArray();
    const longest = sides.indexOf(Math.max(...sides));
    const up = longest === 2 ? 1 : 2;
    const side = 3 - longest - up;
    const away = [0, 0, 0];
    [away[longest], away[up], away[side]] = [0.3, 0.45, longest === 2 ? 1 : -1];
    const far = Math.max(sides[longest] / Math.max(0.5, this.camera.aspect), sides[up] + sides[side]) / (2 * half) + sides[side];
    this.camera.up.set(0, 0, 0).setComponent(up, 1);
    this.controls.target.copy(span.value).multiplyScalar(0.5).add(low.value);
    this.camera.position.fromArray(away).normalize().multiplyScalar(MARGIN * far).add(this.controls.target);
    Object.assign(this.camera, { near: size / 100, far: size * 30 });
    this.camera.updateProjectionMatrix();
    this.aimed = true;
    this.controls.update();
    this.later();
  }

  turn(key) {
    const { Spherical, Vector3, Quaternion } = this.three;
    const moves = { ArrowLeft: [-TURN, 0, 1], ArrowRight: [TURN, 0, 1], ArrowUp: [0, -TURN, 1], ArrowDown: [0, TURN, 1], "+": [0, 0, 0.9], "-": [0, 0, 1.1] };
    if (!moves[key]) return false;
    this.moved = true;
    const [about, over, nearer] = moves[key];
    const level = new Quaternion().setFromUnitVectors(this.camera.up, new Vector3(0, 1, 0));
    const away = this.camera.position.clone().sub(this.controls.target).applyQuaternion(level);
    const place = new Spherical().setFromVector3(away);
    place.set(place.radius * nearer, place.phi + over, place.theta + about).makeSafe();
    this.camera.position.copy(away.setFromSpherical(place).applyQuaternion(level.invert()).add(this.controls.target));
    this.controls.update();
    return true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio || 1));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.snapshot && !this.moved) this.aim(); // The canvas was not on the page when the first snapshot came.
    this.draw();
  }

  // Frames --------------------------------------------------------------------------------------------------------------

  later() {
    if (this.due || this.closed) return;
    this.due = true;
    requestAnimationFrame(() => this.draw());
  }

  // The script time of a frame stands in the browser's own timeline as "conoid:frame", with the number of draw calls.
  draw() {
    this.due = false;
    if (this.closed || !this.snapshot) return;
    const start = performance.now();
    this.renderer.render(this.scene, this.camera);
    performance.measure("conoid:frame", { start, detail: { calls: this.renderer.info.render.calls } });
    performance.clearMeasures("conoid:frame");
  }

  pickable(onPick) {
    let down = null;
    this.canvas.addEventListener("pointerdown", (event) => { down = [event.offsetX, event.offsetY]; });
    this.canvas.addEventListener("click", (event) => {
      const still = down && Math.hypot(event.offsetX - down[0], event.offsetY - down[1]) < 4;
      if (still && this.snapshot) onPick(this.pick(event.offsetX, event.offsetY));
    });
    this.canvas.addEventListener("keydown", (event) => { if (this.turn(event.key)) event.preventDefault(); });
  }

  // The row of the fragment at a place of the canvas (CSS pixels), -1 beside the body: one pixel is drawn by number.
  pick(x, y) {
    const { mode } = this.material.uniforms;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [before, pixel] = [mode.value, new Uint8Array(4)];
    this.camera.setViewOffset(width, height, x, y, 1, 1);
    mode.value = 2;
    this.renderer.setRenderTarget(this.target);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    this.renderer.readRenderTargetPixels(this.target, 0, 0, 1, 1, pixel);
    this.renderer.setRenderTarget(null);
    mode.value = before;
    this.camera.clearViewOffset();
    return pixel[2] === 255 ? pixel[0] + 256 * pixel[1] : -1;
  }

  close() {
    this.closed = true;
    this.watch.disconnect();
    this.controls.dispose();
    this.mesh.geometry.dispose();
    this.renderer.dispose();
  }
}
