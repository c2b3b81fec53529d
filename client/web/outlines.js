// Outlines of the fragments, and a mark around the selected fragment. Lines are drawn where the fragment numbers of a
// second drawing change.

import { LINES, OVER } from "./shaders.js";

const MARK = [1, 0.1, 0.75]; // Colour of the selected fragment; no part has such a strong colour of this hue.
const STRENGTH = 0.55;

export class Outlines {
  constructor(THREE) {
    const { BufferGeometry, BufferAttribute, Color, Mesh, RawShaderMaterial, Scene, WebGLRenderTarget } = THREE;
    this.target = new WebGLRenderTarget(1, 1);
    const uniforms = {
      rows: { value: this.target.texture }, picked: { value: -1 }, thick: { value: 2 }, strength: { value: STRENGTH },
      ink: { value: new Color(0, 0, 0) }, mark: { value: new Color(...MARK) },
    };
    this.material = new RawShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: OVER, fragmentShader: LINES, uniforms, transparent: true, depthTest: false, depthWrite: false,
    });
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(9), 3));
    const over = new Mesh(geometry, this.material);
    over.frustumCulled = false;
    this.scene = new Scene();
    this.scene.add(over);
  }

  size(width, height, ratio) {
    this.target.setSize(width, height);
    this.material.uniforms.thick.value = Math.round(2 * ratio);
  }

  // Draws the outlines. `numbers` is a function that draws the fragment numbers; `camera` may be any camera.
  draw(renderer, numbers, camera, { picked, lines, ink }) {
    const { uniforms } = this.material;
    uniforms.picked.value = picked;
    uniforms.strength.value = lines ? STRENGTH : 0;
    uniforms.ink.value.setRGB(...ink);
    renderer.setRenderTarget(this.target);
    renderer.setClearColor(0, 0);
    renderer.clear();
    numbers();
    renderer.setRenderTarget(null);
    renderer.render(this.scene, camera);
  }

  close() {
    this.target.dispose();
    this.material.dispose();
  }
}
