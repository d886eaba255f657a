/** A mesh on the GPU. */

import type { Mesh } from "../cloud/glb";
import { GlProgram, type UniformValue } from "./gl_program";
import { MESH_FRAGMENT, MESH_VERTEX } from "./shaders";

/** Draws a mesh; `dispose` frees its buffers. */
export class MeshLayer {
  private readonly program: GlProgram;
  private readonly vertices: WebGLVertexArrayObject;
  private readonly buffers: readonly WebGLBuffer[];

  constructor(
    private readonly gl: WebGL2RenderingContext,
    readonly mesh: Mesh,
  ) {
    this.program = new GlProgram(gl, MESH_VERTEX, MESH_FRAGMENT);
    this.vertices = gl.createVertexArray();
    gl.bindVertexArray(this.vertices);
    this.buffers = [
      this.write(gl.ARRAY_BUFFER, mesh.positions_m),
      this.write(gl.ELEMENT_ARRAY_BUFFER, mesh.indices),
    ];
    const position = this.program.attribute("position");
    gl.enableVertexAttribArray(position);
    gl.vertexAttribPointer(position, 3, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
  }

  draw(uniforms: Readonly<Record<string, UniformValue>>): void {
    const { gl } = this;
    this.program.use(uniforms);
    gl.bindVertexArray(this.vertices);
    gl.drawElements(gl.TRIANGLES, this.mesh.indices.length, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }

  dispose(): void {
    for (const buffer of this.buffers) this.gl.deleteBuffer(buffer);
    this.gl.deleteVertexArray(this.vertices);
    this.program.dispose();
  }

  private write(target: number, values: Float32Array | Uint32Array): WebGLBuffer {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(target, buffer);
    this.gl.bufferData(target, values, this.gl.STATIC_DRAW);
    return buffer;
  }
}
