/**
 * The points of a cloud on the graphics card, drawn past three.js.
 *
 * three.js writes a whole new buffer when a chunk begins and goes through all its state for every chunk of every frame;
 * with six million points that was most of a frame. Here a chunk's memory is reserved once, only new points are written,
 * once per frame, and a chunk costs four calls to draw. It is drawn into the picture that three.js has begun.
 */

import { type Camera, Matrix4, type Vector2, type Vector3 } from "three";
import { CHUNK_POINTS, type Cloud, type CloudChunk, WORDS } from "./cloud";
import { type ColourUniforms, REGION_UNIT } from "./layers";
import type { RegionGrid } from "./region";
import { POINT_FRAGMENT, POINT_VERTEX } from "./shaders";

const BYTES_PER_POINT = 2 * WORDS;

/** Values of a point: name in the shader, how many, and at which byte. */
const ATTRIBUTES = [
  { name: "position", size: 3, at_byte: 0 },
  { name: "intensity", size: 1, at_byte: 6 },
  { name: "order_sigma", size: 1, at_byte: 8 },
] as const;

/** A chunk on the card: its points up to `n_written` are there. */
interface Drawn {
  buffer: WebGLBuffer;
  vertices: WebGLVertexArrayObject;
  n_written: number;
}

interface ColourUniform {
  name: string;
  type: number;
  at: WebGLUniformLocation | null;
}

export class CloudLayer {
  visible = true;
  /** Points written to the card so far; a change of colour does not change it. */
  n_uploaded = 0;
  private readonly drawn = new Map<CloudChunk, Drawn>();
  private readonly clip = new Matrix4();
  private grid: RegionGrid | undefined;
  /** The cells of the grid on the card; undefined until they are needed there. */
  private cells: WebGLTexture | undefined;
  private program: WebGLProgram;
  private coloured: ColourUniform[] = [];
  private places = new Map<string, WebGLUniformLocation | null>();

  constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly uniforms: ColourUniforms,
  ) {
    this.program = this.compile();
  }

  /** The context was lost and is there again: nothing of before is on the card. */
  restore(): void {
    this.drawn.clear();
    this.cells = undefined;
    this.program = this.compile();
  }

  /** Which points are of the measured feature; undefined: nobody says. */
  setRegion(grid: RegionGrid | undefined): void {
    if (this.cells) this.gl.deleteTexture(this.cells);
    this.cells = undefined;
    this.grid = grid;
  }

  /**
   * Writes what is new and draws one point in `thinning`; answers how many points that is.
   * Leaves the card in a state that three.js does not know of: `resetState` follows.
   */
  draw(cloud: Cloud, camera: Camera, thinning: number): number {
    const { gl } = this;
    for (const chunk of cloud.chunks) this.write(chunk);
    if (!this.visible) return 0;
    gl.useProgram(this.program);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    this.clip.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    gl.uniformMatrix4fv(this.place("u_clip"), false, this.clip.elements);
    for (const uniform of this.coloured) this.set(uniform);
    if (this.grid) {
      this.cells ??= this.write3D(this.grid);
      gl.activeTexture(gl.TEXTURE0 + REGION_UNIT);
      gl.bindTexture(gl.TEXTURE_3D, this.cells);
    }
    const [origin, step] = [this.place("u_origin"), this.place("u_step")];
    let n_drawn = 0;
    for (const [chunk, { vertices }] of this.drawn) {
      gl.bindVertexArray(vertices);
      gl.uniform3fv(origin, chunk.origin_mm);
      gl.uniform3fv(step, chunk.step_mm);
      for (const { start, count } of chunk.drawn(thinning)) {
        gl.drawArrays(gl.POINTS, start, count);
        n_drawn += count;
      }
    }
    gl.bindVertexArray(null);
    if (this.grid) gl.bindTexture(gl.TEXTURE_3D, null);
    return n_drawn;
  }

  dispose(): void {
    for (const { buffer, vertices } of this.drawn.values()) {
      this.gl.deleteBuffer(buffer);
      this.gl.deleteVertexArray(vertices);
    }
    this.drawn.clear();
    this.setRegion(undefined);
    this.gl.deleteProgram(this.program);
  }

  private write3D({ bytes, region }: RegionGrid): WebGLTexture {
    const { gl } = this;
    const [nx, ny, nz] = region.size;
    const cells = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + REGION_UNIT);
    gl.bindTexture(gl.TEXTURE_3D, cells);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8, nx, ny, nz, 0, gl.RED, gl.UNSIGNED_BYTE, bytes);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_3D, side, gl.NEAREST);
    return cells;
  }

  private write(chunk: CloudChunk): void {
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
      const at = gl.getAttribLocation(this.program, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.UNSIGNED_SHORT, false, BYTES_PER_POINT, at_byte);
    }
    gl.bindVertexArray(null);
    this.drawn.set(chunk, made);
    return made;
  }

  private compile(): WebGLProgram {
    const program = compiled(this.gl);
    this.coloured = this.colourUniforms(program);
    const own = ["u_clip", "u_origin", "u_step"];
    this.places = new Map(own.map((name) => [name, this.gl.getUniformLocation(program, name)]));
    return program;
  }

  private place(name: string): WebGLUniformLocation | null {
    return this.places.get(name) ?? null;
  }

  /** What the shader uses of the colours. */
  private colourUniforms(program: WebGLProgram): ColourUniform[] {
    const { gl } = this;
    const n_uniforms: number = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    const all = Array.from({ length: n_uniforms }, (_, idx) => gl.getActiveUniform(program, idx));
    return all.flatMap((info) => {
      const name = info?.name.replace("[0]", "") ?? "";
      if (!info || !(name in this.uniforms.all)) return [];
      return [{ name, type: info.type, at: gl.getUniformLocation(program, info.name) }];
    });
  }

  private set({ name, type, at }: ColourUniform): void {
    const { gl } = this;
    const value: unknown = this.uniforms.all[name]?.value;
    if (type === gl.FLOAT_VEC3) gl.uniform3fv(at, numbers(value as Vector3 | Vector3[]));
    else if (type === gl.FLOAT_VEC2) gl.uniform2fv(at, (value as Vector2).toArray());
    else if (type === gl.FLOAT) gl.uniform1f(at, Number(value));
    else gl.uniform1i(at, Number(value));
  }
}

function numbers(value: Vector3 | Vector3[]): number[] {
  return Array.isArray(value) ? value.flatMap((one) => one.toArray()) : value.toArray();
}

/** The program of the points. A shader that does not compile is a mistake of this page; a lost card is not. */
function compiled(gl: WebGL2RenderingContext): WebGLProgram {
  const program = gl.createProgram();
  if (gl.isContextLost()) return program;
  for (const [type, source] of [
    [gl.VERTEX_SHADER, POINT_VERTEX],
    [gl.FRAGMENT_SHADER, POINT_FRAGMENT],
  ] as const) {
    const shader = gl.createShader(type);
    if (!shader) continue;
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`the points' shader does not link: ${gl.getProgramInfoLog(program)}`);
  }
  return program;
}
