/** The uniforms that determine the colours of points and mesh. */

import type { Feature } from "../cloud/region";
import { COLOUR_MODES, type Colouring, orderTable, palette, rgb } from "../colours";
import type { UniformValue } from "./gl_program";

/** A change of colour sets only these uniforms and uploads no points. */
export function initialUniforms(): Record<string, UniformValue> {
  return {
    ...colourUniforms({ mode: "order", range: { low: 0, high: 1 }, hide_outside: false }),
    ...featureUniforms(undefined),
    u_palette: palette("height").flatMap(rgb),
    u_orders: orderTable().flat(),
  };
}

export function colourUniforms({ mode, range, hide_outside }: Colouring): Record<string, UniformValue> {
  return {
    u_mode: COLOUR_MODES.indexOf(mode),
    u_range: [range.low, range.high],
    u_hide_outside: Number(hide_outside),
    ...(mode !== "order" && { u_palette: palette(mode).flatMap(rgb) }),
  };
}

export function featureUniforms(feature: Feature | undefined): Record<string, UniformValue> {
  const shape = feature?.shape;
  const region = feature?.grid?.region;
  return {
    u_shape: shape ? { plane: 1, sphere: 2, cylinder: 3 }[shape.kind] : 0,
    ...(shape && {
      u_shape_point: shape.kind === "sphere" ? shape.centre_mm : shape.point_mm,
      u_shape_axis: shape.kind === "plane" ? shape.normal : shape.kind === "cylinder" ? shape.axis : [0, 0, 1],
      u_shape_radius: shape.kind === "plane" ? 0 : shape.radius_mm,
    }),
    u_has_region: Number(region !== undefined),
    ...(region && {
      u_region_origin: region.origin_mm,
      u_region_cell: region.cell_mm,
      u_region_size: region.size,
      u_band_um: 1e3 * region.band_mm,
    }),
  };
}
