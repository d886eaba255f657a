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
uniform highp sampler2D u_surface;
uniform vec2 u_surface_origin;
uniform float u_surface_cell;
uniform highp sampler3D u_deviations;
uniform vec3 u_deviations_origin;
uniform float u_deviations_cell;
const vec3 UNKNOWN = vec3(0.604, 0.627, 0.651);

/** Distance from the surface of another scan; far outside any range where that is unknown. */
const float NOWHERE_UM = 1e9;
float surface_um(vec3 at) {
  vec2 place = (at.xy - u_surface_origin) / u_surface_cell;
  ivec2 cell = ivec2(floor(place));
  ivec2 size = textureSize(u_surface, 0);
  if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, size))) return NOWHERE_UM;
  vec4 plane = texelFetch(u_surface, cell, 0);
  if (plane.w < 0.5) return NOWHERE_UM;
  vec2 away = u_surface_cell * (place - vec2(cell) - 0.5);
  return 1e3 * (plane.x + dot(plane.yz, away) - at.z) / length(vec3(1.0, plane.yz));
}

/** Deviation from a CAD model, from the cells of its map. */
float mapped_um(vec3 at) {
  ivec3 cell = ivec3(floor((at - u_deviations_origin) / u_deviations_cell));
  ivec3 size = textureSize(u_deviations, 0);
  if (any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, size))) return NOWHERE_UM;
  return min(NOWHERE_UM, 1e3 * texelFetch(u_deviations, cell, 0).r);
}

float deviation_um(vec3 at) {
  if (u_shape == 4) return surface_um(at);
  if (u_shape == 5) return mapped_um(at);
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

/** Which part of space is displayed: a box, and one side of a cut. */
const DISPLAYED_SPACE = /* glsl */ `
uniform bool u_crop;
uniform vec3 u_crop_min;
uniform vec3 u_crop_max;
uniform int u_cut_axis;
uniform float u_cut_at;
uniform float u_cut_half;
uniform bool u_cut_hides;

bool is_cropped(vec3 at) {
  if (u_crop && (any(lessThan(at, u_crop_min)) || any(greaterThan(at, u_crop_max)))) return true;
  return u_cut_axis >= 0 && u_cut_hides && at[u_cut_axis] > u_cut_at + u_cut_half;
}

bool is_in_cut(vec3 at) {
  return u_cut_axis >= 0 && abs(at[u_cut_axis] - u_cut_at) <= u_cut_half;
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
flat out float v_depth_mm;
const vec3 CUT_COLOUR = vec3(1.0);
${COLOUR_BY_VALUE}
${DISPLAYED_SPACE}
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
  v_depth_mm = -dot(at, u_towards);
  if (is_cropped(at)) {
    // A position behind the far plane is clipped.
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
    return;
  }
  if (is_in_cut(at)) {
    v_colour = CUT_COLOUR;
    return;
  }
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
    known = u_shape > 0 && value < NOWHERE_UM && belongs(at, value);
    if (known && u_shape < 4) {
      // Which of several overlapping points is visible is random: by depth it would always be those on one side of the
      // surface, and by drawing order those of one diffraction order.
      vec4 deep = u_clip * vec4(foot(at) + u_towards * (lot(position) - 0.5) * u_shuffle_mm, 1.0);
      gl_Position.z = deep.z / deep.w * gl_Position.w;
    }
  }
  v_colour = known ? colour_of(value) : UNKNOWN;
  bool outside = value < u_range.x || value > u_range.y;
  if (u_hide_outside && (known ? outside : u_mode == 4)) gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
}
`;

export const POINT_FRAGMENT = /* glsl */ `${HEAD}
flat in vec3 v_colour;
flat in float v_depth_mm;
layout(location = 0) out vec4 colour;
layout(location = 1) out float depth_mm;
void main() {
  colour = vec4(v_colour, 1.0);
  depth_mm = v_depth_mm;
}
`;

/** Depth of pixels that are not shaded. */
export const BACKGROUND_DEPTH_MM = 1e30;

/** One triangle that covers the canvas. */
export const SHADING_VERTEX = /* glsl */ `${HEAD}
void main() {
  gl_Position = vec4(4.0 * float(gl_VertexID & 1) - 1.0, 4.0 * float(gl_VertexID >> 1) - 1.0, 0.0, 1.0);
}
`;

export const SHADING_FRAGMENT = /* glsl */ `${HEAD}
uniform sampler2D u_colours;
uniform sampler2D u_depths;
uniform float u_mm_per_px;
/** Depth at which that is valid, and the distance of the eye from there; 0 in parallel projection. */
uniform float u_target_mm;
uniform float u_eye_mm;
uniform int u_reach;
out vec4 colour;

/** Neighbours that rise more steeply than this belong to another surface. */
const float STEEPEST = 4.0;
/** Brightness of a surface seen edge-on. */
const float AMBIENT = 0.35;
/** Strength of the darkening beside nearer surfaces. */
const float EDGE = 0.45;

void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  vec4 unshaded = texelFetch(u_colours, here, 0);
  float depth = texelFetch(u_depths, here, 0).r;
  colour = unshaded;
  if (depth > 1e29) return;
  float mm_per_px = u_mm_per_px;
  if (u_eye_mm > 0.0) mm_per_px *= max(0.01, 1.0 + (depth - u_target_mm) / u_eye_mm);
  ivec2 last = textureSize(u_depths, 0) - 1;
  vec2 rises = vec2(0.0);
  vec2 squares = vec2(0.0);
  float nearer = 0.0;
  for (int ring = 1; ring <= 2; ring++) {
    for (int idx = 0; idx < 9; idx++) {
      if (idx == 4) continue;
      ivec2 to = ring * u_reach * ivec2(idx % 3 - 1, idx / 3 - 1);
      float other = texelFetch(u_depths, clamp(here + to, ivec2(0), last), 0).r;
      if (other > 1e29) continue;
      vec2 away = vec2(to);
      float rise_px = (other - depth) / mm_per_px;
      float slope = rise_px / length(away);
      if (abs(slope) <= STEEPEST) {
        rises += away * rise_px;
        squares += away * away;
      }
      nearer += clamp(-slope - 1.0, 0.0, 2.0);
    }
  }
  vec3 normal = normalize(vec3(-rises / max(squares, vec2(1.0)), 1.0));
  float light = (AMBIENT + (1.0 - AMBIENT) * normal.z) * exp(-EDGE * nearer / 4.0);
  colour = vec4(light * unshaded.rgb, 1.0);
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
layout(location = 0) out vec4 colour;
layout(location = 1) out float depth_mm;
${COLOUR_BY_VALUE}
${DISPLAYED_SPACE}
void main() {
  if (is_cropped(v_in_part)) discard;
  // Shaded already.
  depth_mm = ${BACKGROUND_DEPTH_MM};
  vec3 normal = normalize(cross(dFdx(v_in_part), dFdy(v_in_part)));
  float light = 0.35 + 0.65 * abs(dot(normal, u_towards));
  vec3 base = vec3(0.78, 0.80, 0.82);
  bool by_value = u_mode == 1 || (u_mode == 4 && u_shape > 0);
  if (by_value) {
    float value = u_mode == 1 ? v_in_part.z : deviation_um(v_in_part);
    bool far = u_mode == 4 && (value >= NOWHERE_UM || (u_has_region && abs(value) > u_band_um));
    if (u_hide_outside && (far || value < u_range.x || value > u_range.y)) discard;
    base = far ? UNKNOWN : colour_of(value);
  }
  colour = vec4(light * base, 1.0);
}
`;
