/** A WebGL program with its uniforms by name. */

/** A number, a vector, or several concatenated vectors. */
export type UniformValue = number | readonly number[];

export class GlProgram {
  private readonly program: WebGLProgram;
  private readonly uniforms = new Map<string, { type: number; at: WebGLUniformLocation | null }>();

  /** Throws if a shader does not compile, but not if the context is lost. */
  constructor(
    private readonly gl: WebGL2RenderingContext,
    vertex_shader: string,
    fragment_shader: string,
  ) {
    this.program = gl.createProgram();
    if (gl.isContextLost()) return;
    this.attach(gl.VERTEX_SHADER, vertex_shader);
    this.attach(gl.FRAGMENT_SHADER, fragment_shader);
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`a shader does not link: ${gl.getProgramInfoLog(this.program)}`);
    }
    const n_uniforms: number = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS) ?? 0;
    for (let idx = 0; idx < n_uniforms; idx++) {
      const info = gl.getActiveUniform(this.program, idx);
      if (!info) continue;
      const at = gl.getUniformLocation(this.program, info.name);
      this.uniforms.set(info.name.replace("[0]", ""), { type: info.type, at });
    }
  }

  /** Makes the program current and sets its uniforms; unknown names are ignored. */
  use(values: Readonly<Record<string, UniformValue>>): void {
    this.gl.useProgram(this.program);
    for (const [name, value] of Object.entries(values)) this.set(name, value);
  }

  set(name: string, value: UniformValue): void {
    const { gl } = this;
    const uniform = this.uniforms.get(name);
    if (!uniform) return;
    const { type, at } = uniform;
    if (typeof value === "number") {
      if (type === gl.FLOAT) gl.uniform1f(at, value);
      else gl.uniform1i(at, value);
    } else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(at, false, value);
    else if (type === gl.FLOAT_VEC3) gl.uniform3fv(at, value);
    else gl.uniform2fv(at, value);
  }

  /** Location of an attribute. */
  attribute(name: string): number {
    return this.gl.getAttribLocation(this.program, name);
  }

  dispose(): void {
    this.gl.deleteProgram(this.program);
  }

  private attach(type: number, source: string): void {
    const { gl } = this;
    const shader = gl.createShader(type);
    if (!shader) return;
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(this.program, shader);
    gl.deleteShader(shader);
  }
}
