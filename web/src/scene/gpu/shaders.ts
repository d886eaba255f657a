/** The shaders: they compute a value per point or vertex and map it to a colour. */

import { FIRST_ORDER, N_ORDERS, PALETTE_STOPS } from "../colours";

const HEAD = /* glsl */ `#version 300 es
precision highp float;
precision highp int;
`;

/** Modes are numbered by their index in `COLOUR_MODES`. */
const COLOUR_BY_VALUE = /* glsl */ `
uniform vec3 u_palette[${PALETTE_STOPS}];
uniform vec2 u_range;
uniform int u_shape;
uniform vec3 u_shape_point;
uniform vec3 u_shape_axis;
uniform float u_shape_radius;
uniform bool u_has_region;
uniform float u_band_um;
const vec3 UNKNOWN = vec3(0.604, 0.627, 0.651);

float deviation_um(vec3 at) {
  vec3 from = at - u_shape_point;
  float along = dot(u_shape_axis, from);
  if (u_shape == 1) return 1e3 * along;
  if (u_shape == 2) return 1e3 * (length(from) - u_shape_radius);
  return 1e3 * (length(from - along * u_shape_axis) - u_shape_radius);
}

vec3 colour_of(float value) {
  float span = u_range.y - u_range.x;
  float share = span > 0.0 ? clamp((value - u_range.x) / span, 0.0, 1.0) : 0.5;
  float place = share * ${(PALETTE_STOPS - 1).toFixed(1)};
  int first = min(int(place), ${PALETTE_STOPS - 2});
  return mix(u_palette[first], u_palette[first + 1], place - float(first));
}
`;

/** Points: 16-bit positions, decoded with the origin and step of their chunk. */
export const POINT_VERTEX = /* glsl */ `${HEAD}
uniform mat4 u_clip;
uniform vec3 u_origin;
uniform vec3 u_step;
in vec3 position;
uniform int u_mode;
uniform bool u_hide_outside;
uniform vec3 u_orders[${N_ORDERS + 1}];
uniform float u_size_px;
uniform highp sampler3D u_region;
uniform vec3 u_region_origin;
uniform float u_region_cell;
uniform vec3 u_region_size;
uniform vec3 u_towards;
uniform float u_shuffle_mm;
in float intensity;
in float order_sigma;
flat out vec3 v_colour;
${COLOUR_BY_VALUE}
/** Whether a position is in the region of the feature. */
bool belongs(vec3 at, float value) {
  if (!u_has_region) return true;
  vec3 cell = floor((at - u_region_origin) / u_region_cell);
  if (any(lessThan(cell, vec3(0.0))) || any(greaterThanEqual(cell, u_region_size))) return false;
  return abs(value) <= u_band_um && texelFetch(u_region, ivec3(cell), 0).r > 0.5;
}

/** The nearest position on the fitted shape. */
vec3 foot(vec3 at) {
  vec3 from = at - u_shape_point;
  float along = dot(u_shape_axis, from);
  if (u_shape == 1) return at - along * u_shape_axis;
  if (u_shape == 2) return u_shape_point + u_shape_radius * normalize(from);
  vec3 radial = from - along * u_shape_axis;
  return u_shape_point + along * u_shape_axis + u_shape_radius * normalize(radial);
}

/** A pseudo-random number from 0 to 1, constant for each point. */
float lot(vec3 steps) {
  uvec3 at = uvec3(steps);
  uint bits = at.x * 73856093u ^ at.y * 19349663u ^ at.z * 83492791u;
  bits = (bits ^ (bits >> 13)) * 1274126177u;
  return float((bits ^ (bits >> 16)) & 65535u) / 65535.0;
}

void main() {
  vec3 at = u_origin + u_step * position;
  gl_Position = u_clip * vec4(at, 1.0);
  gl_PointSize = u_size_px;
  float sigma_class = floor(order_sigma / 256.0);
  float order_byte = order_sigma - 256.0 * sigma_class;
  if (u_mode == 0) {
    int order = int(order_byte < 128.0 ? order_byte : order_byte - 256.0) - (${FIRST_ORDER});
    v_colour = u_orders[order < 0 || order >= ${N_ORDERS} ? ${N_ORDERS} : order];
    return;
  }
  bool known = true;
  float value = at.z;
  if (u_mode == 2) {
    known = sigma_class < 255.0;
    value = 0.1 * exp2(sigma_class / 16.0);
  } else if (u_mode == 3) {
    value = intensity;
  } else if (u_mode == 4) {
    value = deviation_um(at);
    known = u_shape > 0 && belongs(at, value);
    if (known) {
      // Which of several overlapping points is visible is random: by depth it would always be those on one side of the
      // surface, and by drawing order those of one diffraction order.
      vec4 deep = u_clip * vec4(foot(at) + u_towards * (lot(position) - 0.5) * u_shuffle_mm, 1.0);
      gl_Position.z = deep.z / deep.w * gl_Position.w;
    }
  }
  v_colour = known ? colour_of(value) : UNKNOWN;
  // A position behind the far plane is clipped.
  bool outside = value < u_range.x || value > u_range.y;
  if (u_hide_outside && (known ? outside : u_mode == 4)) gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
}
`;

export const POINT_FRAGMENT = /* glsl */ `${HEAD}
flat in vec3 v_colour;
out vec4 colour;
void main() {
  colour = vec4(v_colour, 1.0);
}
`;

/** Meshes, positions in metres: flat shading with a light at the viewer. */
export const MESH_VERTEX = /* glsl */ `${HEAD}
uniform mat4 u_clip;
in vec3 position;
out vec3 v_in_part;
void main() {
  v_in_part = 1e3 * position;
  gl_Position = u_clip * vec4(v_in_part, 1.0);
}
`;

export const MESH_FRAGMENT = /* glsl */ `${HEAD}
uniform int u_mode;
uniform bool u_hide_outside;
uniform vec3 u_towards;
in vec3 v_in_part;
out vec4 colour;
${COLOUR_BY_VALUE}
void main() {
  vec3 normal = normalize(cross(dFdx(v_in_part), dFdy(v_in_part)));
  float light = 0.35 + 0.65 * abs(dot(normal, u_towards));
  vec3 base = vec3(0.78, 0.80, 0.82);
  bool by_value = u_mode == 1 || (u_mode == 4 && u_shape > 0);
  if (by_value) {
    float value = u_mode == 1 ? v_in_part.z : deviation_um(v_in_part);
    bool far = u_mode == 4 && u_has_region && abs(value) > u_band_um;
    if (u_hide_outside && (far || value < u_range.x || value > u_range.y)) discard;
    base = far ? UNKNOWN : colour_of(value);
  }
  colour = vec4(light * base, 1.0);
}
`;
