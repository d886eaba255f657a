/**
 * three.js without what a cloud of points never uses.
 *
 * The viewer draws with its own shaders: three's materials, shadows, environments and headsets would be a third of the
 * page. Their modules are replaced by empty ones while building; using one of them fails loudly (a shader that does
 * not compile, a method that is not there), and the tests in the browser draw every layer.
 */

import type { Plugin } from "vite";

/** Shader texts that three puts before every shader, also before ours. */
const KEPT_CHUNKS = ["colorspace_pars_fragment", "tonemapping_pars_fragment"];

/** A renderer asks whether a headset is there; there is none. */
const NO_HEADSET = `export class WebXRManager {
  enabled = false;
  isPresenting = false;
  cameraAutoUpdate = false;
  addEventListener() {}
  removeEventListener() {}
  setAnimationLoop() {}
  getEnvironmentBlendMode() {}
  dispose() {}
}`;

/** Nothing casts shadows. */
const NO_SHADOWS = `export function WebGLShadowMap() {
  this.enabled = false;
  this.render = () => {};
}`;

/** Nothing is mirrored. */
const NO_ENVIRONMENTS = `export function WebGLEnvironments() {
  return { get: (environment) => environment, dispose() {} };
}`;

/** Nothing is lit: our shaders know no lights. */
const NO_LIGHTS = `export function WebGLLights() {
  const none = [];
  const state = {
    version: 0, hash: {}, numSpotLightShadowsWithMaps: 0, numLightProbes: 0,
    sun: none, directional: none, point: none, spot: none, spotLightMap: none, rectArea: none, hemi: none,
    sunShadowMap: none, directionalShadowMap: none, pointShadowMap: none, spotShadowMap: none,
  };
  return { state, setup() {}, setupView() {} };
}`;

/** Our uniforms are set by the viewer; three's materials would set theirs here. */
const NO_MATERIALS = `export function WebGLMaterials() {
  return { refreshFogUniforms() {}, refreshMaterialUniforms() {} };
}`;

/** No meshes that change shape. */
const NO_MORPHING = "export function WebGLMorphtargets() { return { update() {} }; }";

/** No uniforms in groups. */
const NO_GROUPS = "export function WebGLUniformsGroups() { return { dispose() {}, update() {}, bind() {} }; }";

const REPLACED: readonly [RegExp, string][] = [
  [/\/shaders\/ShaderLib\/[^/]+\.glsl\.js$/, 'export const vertex = ""; export const fragment = "";'],
  [/\/webxr\/WebXRManager\.js$/, NO_HEADSET],
  [/\/webgl\/WebGLShadowMap\.js$/, NO_SHADOWS],
  [/\/webgl\/WebGLLights\.js$/, NO_LIGHTS],
  [/\/webgl\/WebGLMaterials\.js$/, NO_MATERIALS],
  [/\/webgl\/WebGLMorphtargets\.js$/, NO_MORPHING],
  [/\/webgl\/WebGLUniformsGroups\.js$/, NO_GROUPS],
  [/\/webgl\/WebGLEnvironments\.js$/, NO_ENVIRONMENTS],
];

export function slimThree(): Plugin {
  return {
    name: "sheaf-slim-three",
    enforce: "pre",
    // The sources instead of the one built file, so that modules can be told apart.
    config: () => ({ resolve: { alias: [{ find: /^three$/, replacement: "three/src/Three.js" }] } }),
    load(id) {
      if (!id.includes("/three/src/")) return undefined;
      const chunk = /\/ShaderChunk\/([^/]+)\.glsl\.js$/.exec(id)?.[1];
      if (chunk && !KEPT_CHUNKS.includes(chunk)) return 'export default "";';
      return REPLACED.find(([path]) => path.test(id))?.[1];
    },
  };
}
