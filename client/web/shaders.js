// The program that draws the body: places from 16 bits, an offset and a colour of each fragment from small textures.

export const ROWS_WIDTH = 256; // Texels in a line of a texture that has one texel a fragment.

export const VERTEX = `
precision highp float;
precision highp int;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 low, span, middle;
uniform float explode;
uniform int picked;
uniform sampler2D centres, tints;
in vec4 corner;
in float value;
out vec3 view, place;
out float level;
flat out vec4 tint;
flat out int row;
void main() {
  row = int(corner.w);
  ivec2 texel = ivec2(row % ${ROWS_WIDTH}, row / ${ROWS_WIDTH});
  place = low + span * corner.xyz / 65535.0;
  vec3 apart = explode * (texelFetch(centres, texel, 0).xyz - middle);
  vec4 seen = modelViewMatrix * vec4(place + apart, 1.0);
  view = seen.xyz;
  level = value;
  tint = texelFetch(tints, texel, 0);
  if (row == picked) tint.a = 0.0;
  gl_Position = projectionMatrix * seen;
}`;

// mode 0: the colour of the fragment; 1: the value through the map; 2: the number of the row, to pick by.
export const FRAGMENT = `
precision highp float;
precision highp int;
uniform int mode;
uniform vec4 plane;
uniform vec2 range;
uniform sampler2D map;
in vec3 view, place;
in float level;
flat in vec4 tint;
flat in int row;
out vec4 colour;
void main() {
  if (dot(plane.xyz, place) > plane.w) discard;
  if (mode == 2) {
    colour = vec4(float(row & 255), float((row >> 8) & 255), 255.0, 255.0) / 255.0;
    return;
  }
  vec3 normal = normalize(cross(dFdx(view), dFdy(view)));
  vec3 base = mode == 0 ? tint.rgb : texture(map, vec2(level * range.x + range.y, 0.5)).rgb;
  float light = 0.45 + 0.55 * abs(dot(normal, normalize(vec3(0.3, 0.5, 1.0))));
  if (!gl_FrontFacing) base *= 0.6;
  if (tint.a == 0.0) base = mix(base, vec3(1.0, 0.9, 0.2), 0.75);
  colour = vec4(base * light, 1.0);
}`;
