/** The uniforms that determine the colours of points and mesh. */

import type { Feature } from "../cloud/region";
import type { FittedShape } from "../cloud/shapes";
import type { DisplayedSpace } from "../cloud/space";
import { COLOUR_MODES, type Colouring, orderTable, palette, rgb } from "../colours";
import type { UniformValue } from "./gl_program";

/** A change of colour sets only these uniforms and uploads no points. */
export function initialUniforms(): Record<string, UniformValue> {
  return {
    ...colourUniforms({ mode: "order", range: { low: 0, high: 1 }, hide_outside: false }),
    ...featureUniforms(undefined),
    ...spaceUniforms({ crop: undefined, cut: undefined }),
    u_palette: palette("height").flatMap(rgb),
    u_orders: orderTable().flat(),
  };
}

/** Texture units of the surface of another scan, and of the deviations from a CAD model. */
export const SURFACE_UNIT = 2;
export const DEVIATIONS_UNIT = 3;

function shapeUniforms(shape: FittedShape): Record<string, UniformValue> {
  switch (shape.kind) {
    case "plane":
      return { u_shape_point: shape.point_mm, u_shape_axis: shape.normal, u_shape_radius: 0 };
    case "sphere":
      return { u_shape_point: shape.centre_mm, u_shape_axis: [0, 0, 1], u_shape_radius: shape.radius_mm };
    case "cylinder":
      return { u_shape_point: shape.point_mm, u_shape_axis: shape.axis, u_shape_radius: shape.radius_mm };
    case "surface":
      return { u_surface_origin: shape.map.origin_mm, u_surface_cell: shape.map.cell_mm };
    case "model":
      return { u_deviations_origin: shape.map.origin_mm, u_deviations_cell: shape.map.cell_mm };
  }
}

export function colourUniforms({ mode, range, hide_outside }: Colouring): Record<string, UniformValue> {
  return {
    u_mode: COLOUR_MODES.indexOf(mode),
    u_range: [range.low, range.high],
    u_hide_outside: Number(hide_outside),
    ...(mode !== "order" && { u_palette: palette(mode).flatMap(rgb) }),
  };
}

export function spaceUniforms({ crop, cut }: DisplayedSpace): Record<string, UniformValue> {
  return {
    u_crop: Number(crop !== undefined),
    ...(crop && { u_crop_min: crop.min, u_crop_max: crop.max }),
    u_cut_axis: cut ? cut.axis : -1,
    ...(cut && { u_cut_at: cut.at_mm, u_cut_half: cut.thickness_mm / 2, u_cut_hides: Number(cut.hides) }),
  };
}

export function featureUniforms(feature: Feature | undefined): Record<string, UniformValue> {
  const shape = feature?.shape;
  const region = feature?.grid?.region;
  return {
    u_shape: shape ? { plane: 1, sphere: 2, cylinder: 3, surface: 4, model: 5 }[shape.kind] : 0,
    u_surface: SURFACE_UNIT,
    u_deviations: DEVIATIONS_UNIT,
    ...(shape && shapeUniforms(shape)),
    u_has_region: Number(region !== undefined),
    ...(region && {
      u_region_origin: region.origin_mm,
      u_region_cell: region.cell_mm,
      u_region_size: region.size,
      u_band_um: 1e3 * region.band_mm,
    }),
  };
}
