/** Choices of select fields, in display order. */

import type { Schemas } from "../api/client";

export type Tool = Schemas["ToolDto"];
export type SceneName = Schemas["SceneNameDto"];

export const TOOLS: readonly Tool[] = ["sphere", "cylinder", "plane", "flatness", "step", "distance", "angle"];

/** File formats of the point cloud and the mesh of a scan. */
export const CLOUD_FORMATS = ["ply", "e57", "csv", "pcd"] as const;
export const MESH_FORMATS = ["stl", "glb", "ply"] as const;

/** Scenes of the simulated stage that need no file. */
export const SCENES: readonly SceneName[] = ["sphere", "gauge", "freeform", "plate"];
