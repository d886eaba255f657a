/**
 * The points of a cloud on the GPU.
 *
 * The buffer of a chunk is allocated once, only new points are uploaded, once per frame, and drawing a chunk takes four
 * calls.
 */

import { CHUNK_POINTS, type Cloud, type CloudChunk, WORDS } from "../cloud/cloud";
import type { DeviationMap } from "../cloud/deviation_map";
import type { HeightMap } from "../cloud/height_map";
import type { RegionGrid } from "../cloud/region";
import { GlProgram, type UniformValue } from "./gl_program";
import { POINT_FRAGMENT, POINT_VERTEX } from "./shaders";
import { DEVIATIONS_UNIT, SURFACE_UNIT } from "./uniforms";

const BYTES_PER_POINT = 2 * WORDS;

/** Vertex attributes of a point: name in the shader, number of components, byte offset. */
const ATTRIBUTES = [
  { name: "position", size: 3, at_byte: 0 },
  { name: "intensity", size: 1, at_byte: 6 },
  { name: "order_sigma", size: 1, at_byte: 8 },
] as const;

/** The buffers of a chunk, which contain its first `n_written` points. */
interface Drawn {
  buffer: WebGLBuffer;
  vertices: WebGLVertexArrayObject;
  n_written: number;
}

export class CloudLayer {
  /** Points uploaded to the GPU so far; changes of colour upload none. */
  n_uploaded = 0;
  private readonly drawn = new Map<CloudChunk, Drawn>();
  private grid: RegionGrid | undefined;
  /** Texture of the region's cells; undefined until needed. */
  private cells: WebGLTexture | undefined;
  private surface: HeightMap | undefined;
  private planes: WebGLTexture | undefined;
  private map: DeviationMap | undefined;
  private deviations: WebGLTexture | undefined;
  private program: GlProgram;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.program = new GlProgram(gl, POINT_VERTEX, POINT_FRAGMENT);
  }

  /** Called when the context was restored: all GPU objects must be created again. */
  restore(): void {
    this.drawn.clear();
    this.cells = undefined;
    this.planes = undefined;
    this.deviations = undefined;
    this.program = new GlProgram(this.gl, POINT_VERTEX, POINT_FRAGMENT);
  }

  /** Sets the region of the measured feature; undefined if there is none. */
  setRegion(grid: RegionGrid | undefined): void {
    if (this.cells) this.gl.deleteTexture(this.cells);
    this.cells = undefined;
    this.grid = grid;
  }

  /** Sets the surface of another scan from which deviations are computed. */
  setSurface(surface: HeightMap | undefined): void {
    if (this.planes) this.gl.deleteTexture(this.planes);
    this.planes = undefined;
    this.surface = surface;
  }

  /** Sets the map of the deviations from a CAD model. */
  setDeviations(map: DeviationMap | undefined): void {
    if (this.deviations) this.gl.deleteTexture(this.deviations);
    this.deviations = undefined;
    this.map = map;
  }

  /** Uploads new points. */
  write(cloud: Cloud): void {
    for (const chunk of cloud.chunks) this.writeChunk(chunk);
  }

  /** Binds the textures from which values of points, and of the mesh, are computed. */
  bindMaps(): void {
    const { gl } = this;
    if (this.grid) {
      this.cells ??= this.write3D(this.grid);
      gl.bindTexture(gl.TEXTURE_3D, this.cells);
    }
    if (this.surface) {
      this.planes ??= this.writePlanes(this.surface);
      gl.activeTexture(gl.TEXTURE0 + SURFACE_UNIT);
      gl.bindTexture(gl.TEXTURE_2D, this.planes);
      gl.activeTexture(gl.TEXTURE0);
    }
    if (this.map) {
      gl.activeTexture(gl.TEXTURE0 + DEVIATIONS_UNIT);
      this.deviations ??= this.writeDeviations(this.map);
      gl.bindTexture(gl.TEXTURE_3D, this.deviations);
      gl.activeTexture(gl.TEXTURE0);
    }
  }

  /** Draws one point in `thinning`, after `bindMaps`; returns the number of points drawn. */
  draw(uniforms: Readonly<Record<string, UniformValue>>, thinning: number): number {
    const { gl, program } = this;
    program.use(uniforms);
    let n_drawn = 0;
    for (const [chunk, { vertices }] of this.drawn) {
      gl.bindVertexArray(vertices);
      program.set("u_origin", chunk.origin_mm);
      program.set("u_step", chunk.step_mm);
      for (const { start, count } of chunk.drawn(thinning)) {
        gl.drawArrays(gl.POINTS, start, count);
        n_drawn += count;
      }
    }
    gl.bindVertexArray(null);
    return n_drawn;
  }

  dispose(): void {
    for (const { buffer, vertices } of this.drawn.values()) {
      this.gl.deleteBuffer(buffer);
      this.gl.deleteVertexArray(vertices);
    }
    this.drawn.clear();
    this.setRegion(undefined);
    this.setSurface(undefined);
    this.setDeviations(undefined);
    this.program.dispose();
  }

  private write3D({ bytes, size }: RegionGrid): WebGLTexture {
    const { gl } = this;
    const [nx, ny, nz] = size;
    const cells = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_3D, cells);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8, nx, ny, nz, 0, gl.RED, gl.UNSIGNED_BYTE, bytes);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_3D, side, gl.NEAREST);
    return cells;
  }

  private writePlanes({ values, size }: HeightMap): WebGLTexture {
    const { gl } = this;
    const planes = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, planes);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, size[0], size[1], 0, gl.RGBA, gl.FLOAT, values);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    return planes;
  }

  private writeDeviations({ values, size }: DeviationMap): WebGLTexture {
    const { gl } = this;
    const [nx, ny, nz] = size;
    const deviations = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_3D, deviations);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R32F, nx, ny, nz, 0, gl.RED, gl.FLOAT, values);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_3D, side, gl.NEAREST);
    return deviations;
  }

  private writeChunk(chunk: CloudChunk): void {
    const { gl } = this;
    const drawn = this.drawn.get(chunk) ?? this.make(chunk);
    if (drawn.n_written === chunk.n_points) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, drawn.buffer);
    for (const { start, count } of chunk.written(drawn.n_written, chunk.n_points)) {
      gl.bufferSubData(gl.ARRAY_BUFFER, BYTES_PER_POINT * start, chunk.words, WORDS * start, WORDS * count);
    }
    this.n_uploaded += chunk.n_points - drawn.n_written;
    drawn.n_written = chunk.n_points;
  }

  private make(chunk: CloudChunk): Drawn {
    const { gl } = this;
    const made = { buffer: gl.createBuffer(), vertices: gl.createVertexArray(), n_written: 0 };
    gl.bindVertexArray(made.vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, BYTES_PER_POINT * CHUNK_POINTS, gl.DYNAMIC_DRAW);
    for (const { name, size, at_byte } of ATTRIBUTES) {
      const at = this.program.attribute(name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.UNSIGNED_SHORT, false, BYTES_PER_POINT, at_byte);
    }
    gl.bindVertexArray(null);
    this.drawn.set(chunk, made);
    return made;
  }
}
