// Shaders of the 3-D view: positions from 16-bit numbers, offset and colour of each fragment from small textures.

export const ROWS_WIDTH = 256; // Number of texels in a row of a texture that has one texel for each fragment.
export const MOST_PARTS = 256;

// Vertex shader. `mirrors`: planes with x, y, z of the normal and the distance; bit k of the number of an image means
// that the image lies behind plane k. `layer`: -1 draws the opaque parts, k draws only part k. Other vertices are moved
// outside of the view.
export const VERTEX = `
precision highp float;
precision highp int;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 low, span, middle;
uniform vec4 mirrors[3];
uniform float explode, edges;
uniform int image, layer;
uniform sampler2D centres, tints, shown;
in vec4 corner;
in float value, part, omit;
out vec3 view, place, edge;
out float level;
flat out vec4 tint;
flat out int row;
flat out float turned, opacity;
void main() {
  row = int(corner.w);
  ivec2 texel = ivec2(row % ${ROWS_WIDTH}, row / ${ROWS_WIDTH});
  place = low + span * corner.xyz / 65535.0;
  vec3 seenAt = place + explode * (texelFetch(centres, texel, 0).xyz - middle);
  turned = 1.0;
  int mirrored = image + gl_InstanceID;
  for (int k = 0; mirrored >> k > 0; k += 1) {
    if (((mirrored >> k) & 1) == 1) {
      place -= 2.0 * (dot(mirrors[k].xyz, place) - mirrors[k].w) * mirrors[k].xyz;
      seenAt -= 2.0 * (dot(mirrors[k].xyz, seenAt) - mirrors[k].w) * mirrors[k].xyz;
      turned = -turned;
    }
  }
  vec4 seen = modelViewMatrix * vec4(seenAt, 1.0);
  view = seen.xyz;
  level = value;
  edge = vec3(0.0);
  if (edges > 0.0) {
    int number = gl_VertexID % 3;
    edge = vec3(number == 0, number == 1, number == 2);
    if (omit == 1.0) edge.y = 1.0;
    if (omit == 2.0) edge.z = 1.0;
  }
  tint = texelFetch(tints, texel, 0);
  opacity = texelFetch(shown, ivec2(int(part + 0.5), 0), 0).r;
  bool solid = opacity > 0.995;
  gl_Position = projectionMatrix * seen;
  if (layer < 0 ? !solid : (solid || opacity < 0.005 || int(part + 0.5) != layer)) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

// Fragment shader. mode 0: colour of the fragment; mode 1: colour of the value; mode 2: number of the row, for picking
// and for outlines. Faces in a plane of symmetry (nearer than `thin`) lie between a body and its image and are not
// drawn. `cap` 1: a section, without light and without cutting. `plane`: the material beyond the plane is cut away.
export const FRAGMENT = `
precision highp float;
precision highp int;
uniform int mode, cap, planes;
uniform float edges, thin;
uniform vec4 plane;
uniform vec4 mirrors[3];
uniform vec2 range;
uniform vec3 ink;
uniform sampler2D map;
in vec3 view, place, edge;
in float level;
flat in vec4 tint;
flat in int row;
flat in float turned, opacity;
out vec4 colour;
bool between() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  for (int k = 0; k < planes; k += 1) {
    if (abs(dot(mirrors[k].xyz, place) - mirrors[k].w) < thin && abs(dot(mirrors[k].xyz, normal)) > 0.9) return true;
  }
  return false;
}
void main() {
  if (cap == 0 && (dot(plane.xyz, place) > plane.w || (planes > 0 && between()))) discard;
  if (mode == 2) {
    colour = vec4(float(row & 255), float((row >> 8) & 255), cap == 0 ? 255.0 : 254.0, 255.0) / 255.0;
    return;
  }
  vec3 normal = normalize(cross(dFdx(view), dFdy(view)));
  vec3 base = mode == 0 ? tint.rgb : texture(map, vec2(level * range.x + range.y, 0.5)).rgb;
  float facing = abs(dot(normal, normalize(view)));
  float light = 0.56 + 0.3 * abs(dot(normal, normalize(vec3(0.25, 0.55, 1.0)))) + 0.2 * facing;
  if (cap == 0 && (gl_FrontFacing ? 1.0 : -1.0) * turned < 0.0) base *= 0.55;
  if (cap == 1) light = 1.0;
  vec3 shade = base * light;
  if (edges > 0.0) {
    vec3 near = edge / max(fwidth(edge), vec3(1e-6));
    float line = 1.0 - smoothstep(0.0, 0.9, min(min(near.x, near.y), near.z));
    shade = mix(shade, ink, edges * line);
  }
  colour = vec4(shade, opacity);
}`;

// Vertex shader of one triangle over the whole picture, for lines where the numbers of `rows` change.
export const OVER = `
precision highp float;
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;

// Fragment shader that draws thin lines around every fragment, and a thick line in its own colour around the selected
// fragment.
export const LINES = `
precision highp float;
precision highp int;
uniform sampler2D rows;
uniform int picked, thick;
uniform float strength;
uniform vec3 ink, mark;
out vec4 colour;
int at(ivec2 place, ivec2 size) {
  vec4 found = texelFetch(rows, clamp(place, ivec2(0), size - 1), 0);
  return found.b == 0.0 ? -1 : int(found.r * 255.0 + 0.5) + 256 * int(found.g * 255.0 + 0.5);
}
void main() {
  ivec2 size = textureSize(rows, 0);
  ivec2 here = ivec2(gl_FragCoord.xy);
  int own = at(here, size);
  float differ = 0.0;
  for (int i = -1; i <= 1; i += 1) for (int j = -1; j <= 1; j += 1) {
    if (at(here + ivec2(i, j), size) != own) differ += i == 0 || j == 0 ? 1.0 : 0.7;
  }
  // differ is 2.4 at a straight line, and less at the steps of a line
  colour = vec4(ink, strength * min(differ / 3.0, 1.0));
  if (picked < 0) return;
  float close = 0.0;
  for (int i = -thick; i <= thick; i += 1) for (int j = -thick; j <= thick; j += 1) {
    bool mine = at(here + ivec2(i, j), size) == picked;
    if (mine != (own == picked) && i * i + j * j <= thick * thick) close = 1.0;
  }
  if (close > 0.0) colour = vec4(mark, 1.0);
}`;
