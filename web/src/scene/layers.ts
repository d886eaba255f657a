/** The mesh on the graphics card, and the uniforms by which mesh and points are coloured. */

import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  GLSL3,
  type IUniform,
  Mesh,
  RawShaderMaterial,
  type Scene,
  Vector2,
  Vector3,
} from "three";
import { COLOUR_MODES, type Colouring, orderTable, palette, rgb } from "./colours";
import type { Mesh as MeshData } from "./glb";
import type { Feature } from "./region";
import { MESH_FRAGMENT, MESH_VERTEX } from "./shaders";

const MM_PER_METRE = 1000;

/** Texture unit of the cells of a feature: three.js counts its own from 0. */
export const REGION_UNIT = 7;

/** Uniforms of both programs; changing a colour changes these and nothing else. */
export class ColourUniforms {
  readonly all: Record<string, IUniform> = {
    u_mode: { value: 0 },
    u_range: { value: new Vector2(0, 1) },
    u_hide_outside: { value: false },
    u_palette: { value: vectors(palette("height").map(rgb)) },
    u_orders: { value: vectors(orderTable()) },
    u_shape: { value: 0 },
    u_shape_point: { value: new Vector3() },
    u_shape_axis: { value: new Vector3(0, 0, 1) },
    u_shape_radius: { value: 0 },
    u_has_region: { value: false },
    u_region: { value: REGION_UNIT },
    u_region_origin: { value: new Vector3() },
    u_region_cell: { value: 1 },
    u_region_size: { value: new Vector3(1, 1, 1) },
    u_band_um: { value: 0 },
    u_towards: { value: new Vector3(0, 0, 1) },
    u_shuffle_mm: { value: 0 },
    u_size_px: { value: 2 },
  };

  colour({ mode, range, hide_outside }: Colouring): void {
    this.set("u_mode", COLOUR_MODES.indexOf(mode));
    this.set("u_range", new Vector2(range.low, range.high));
    this.set("u_hide_outside", hide_outside);
    if (mode !== "order") this.set("u_palette", vectors(palette(mode).map(rgb)));
  }

  feature(feature: Feature | undefined): void {
    const shape = feature?.shape;
    const region = feature?.grid?.region;
    this.set("u_has_region", region !== undefined);
    if (region) {
      this.set("u_region_origin", new Vector3(...region.origin_mm));
      this.set("u_region_cell", region.cell_mm);
      this.set("u_region_size", new Vector3(...region.size));
      this.set("u_band_um", 1e3 * region.band_mm);
    }
    this.set("u_shape", shape ? { plane: 1, sphere: 2, cylinder: 3 }[shape.kind] : 0);
    if (!shape) return;
    this.set("u_shape_point", new Vector3(...(shape.kind === "sphere" ? shape.centre_mm : shape.point_mm)));
    if (shape.kind !== "sphere") {
      this.set("u_shape_axis", new Vector3(...(shape.kind === "plane" ? shape.normal : shape.axis)));
    }
    this.set("u_shape_radius", shape.kind === "plane" ? 0 : shape.radius_mm);
  }

  set(name: string, value: unknown): void {
    const uniform = this.all[name];
    if (uniform) uniform.value = value;
  }
}

function vectors(colours: readonly (readonly [number, number, number])[]): Vector3[] {
  return colours.map((colour) => new Vector3(...colour));
}

/** A surface; frees its buffers in `dispose`. */
export class MeshLayer {
  private readonly mesh: Mesh;
  private readonly material: RawShaderMaterial;

  constructor(
    private readonly scene: Scene,
    uniforms: ColourUniforms,
    { positions_m, indices }: MeshData,
  ) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions_m, 3));
    geometry.setIndex(new BufferAttribute(indices, 1));
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: MESH_VERTEX,
      fragmentShader: MESH_FRAGMENT,
      uniforms: uniforms.all,
      side: DoubleSide,
    });
    this.mesh = new Mesh(geometry, this.material);
    this.mesh.scale.setScalar(MM_PER_METRE);
    this.mesh.frustumCulled = false;
    this.mesh.updateMatrixWorld();
    scene.add(this.mesh);
  }

  set visible(visible: boolean) {
    this.mesh.visible = visible;
  }

  dispose(): void {
    this.scene.remove(this.mesh);
    this.mesh.geometry.dispose();
    this.material.dispose();
  }
}
