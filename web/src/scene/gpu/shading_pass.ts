/**
 * Shades the drawn points by the shape of their surface.
 *
 * Points have no normals, so these are computed from the depths around each pixel. Steps to nearer neighbours are
 * darkened (eye-dome lighting, Boucheny 2009), so that edges are visible where normals are not.
 */

import { GlProgram } from "./gl_program";
import { BACKGROUND_DEPTH_MM, SHADING_FRAGMENT, SHADING_VERTEX } from "./shaders";

export interface ShadingScale {
  /** Size of a pixel at the target of the view. */
  mm_per_px: number;
  /** Depth of the target. */
  target_mm: number;
  /** Distance of the eye from the target; 0 in parallel projection. */
  eye_mm: number;
  /** Distance of the neighbours that are compared. */
  reach_px: number;
}

export class ShadingPass {
  private readonly program: GlProgram;
  private readonly frame: WebGLFramebuffer;
  private readonly colour: WebGLTexture;
  private readonly depth: WebGLTexture;
  private readonly hidden: WebGLRenderbuffer;
  private size = [0, 0];

  /** Undefined if the browser cannot draw depths into a texture. */
  static create(gl: WebGL2RenderingContext): ShadingPass | undefined {
    return gl.getExtension("EXT_color_buffer_float") ? new ShadingPass(gl) : undefined;
  }

  private constructor(private readonly gl: WebGL2RenderingContext) {
    this.program = new GlProgram(gl, SHADING_VERTEX, SHADING_FRAGMENT);
    this.frame = gl.createFramebuffer();
    this.colour = gl.createTexture();
    this.depth = gl.createTexture();
    this.hidden = gl.createRenderbuffer();
  }

  /** Everything is drawn into textures until `end`. */
  begin(background: readonly [number, number, number]): void {
    const { gl } = this;
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    if (this.size[0] !== width || this.size[1] !== height) this.resize(width, height);
    gl.clearBufferfv(gl.COLOR, 0, [...background, 1]);
    gl.clearBufferfv(gl.COLOR, 1, [BACKGROUND_DEPTH_MM, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
  }

  /** Draws the shaded image on the canvas. */
  end({ mm_per_px, target_mm, eye_mm, reach_px }: ShadingScale): void {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.DEPTH_TEST);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.depth);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.colour);
    this.program.use({
      u_colours: 0,
      u_depths: 1,
      u_mm_per_px: mm_per_px,
      u_target_mm: target_mm,
      u_eye_mm: eye_mm,
      u_reach: reach_px,
    });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  dispose(): void {
    const { gl } = this;
    gl.deleteFramebuffer(this.frame);
    gl.deleteTexture(this.colour);
    gl.deleteTexture(this.depth);
    gl.deleteRenderbuffer(this.hidden);
    this.program.dispose();
  }

  private resize(width: number, height: number): void {
    const { gl } = this;
    this.size = [width, height];
    const attach = (texture: WebGLTexture, attachment: number, format: number) => {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      // A texture of fixed size cannot be resized, one of `texImage2D` can.
      const [base, type] = format === gl.R32F ? [gl.RED, gl.FLOAT] : [gl.RGBA, gl.UNSIGNED_BYTE];
      gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, base, type, null);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
    };
    attach(this.colour, gl.COLOR_ATTACHMENT0, gl.RGBA8);
    attach(this.depth, gl.COLOR_ATTACHMENT1, gl.R32F);
    gl.bindRenderbuffer(gl.RENDERBUFFER, this.hidden);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, this.hidden);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
  }
}
