/** Reads the mesh of a scan from GLB as written by this server: one mesh, float positions, 32-bit indices. */

export interface Mesh {
  /** x, y, z, interleaved, part frame, metres. */
  positions_m: Float32Array;
  /** Vertex indices of the triangles. */
  indices: Uint32Array;
}

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;

interface Accessor {
  bufferView: number;
  byteOffset?: number;
  componentType: number;
  count: number;
}

interface GltfDocument {
  accessors: Accessor[];
  bufferViews: { byteOffset?: number }[];
  meshes: { primitives: { attributes: { POSITION: number }; indices: number }[] }[];
}

/** The mesh as views into the file; empty if the file contains none. */
export function meshFromGlb(file: ArrayBuffer): Mesh {
  const view = new DataView(file);
  if (file.byteLength < 20 || view.getUint32(0, true) !== MAGIC) throw new Error("the mesh is no GLB file");
  const text_bytes = view.getUint32(12, true);
  if (view.getUint32(16, true) !== JSON_CHUNK) throw new Error("the GLB file has no description");
  const text = new TextDecoder().decode(new Uint8Array(file, 20, text_bytes));
  const document: GltfDocument = JSON.parse(text);
  const { accessors, bufferViews, meshes } = document;
  const primitive = meshes?.[0]?.primitives[0];
  const [positions, corners] = [
    accessors?.[primitive?.attributes.POSITION ?? -1],
    accessors?.[primitive?.indices ?? -1],
  ];
  if (!positions || !corners) return { positions_m: new Float32Array(), indices: new Uint32Array() };
  if (positions.componentType !== 5126 || corners.componentType !== 5125) {
    throw new Error("the GLB file has other number types than this viewer reads");
  }
  const binary_at = 20 + text_bytes + 8;
  const start = (accessor: Accessor) =>
    binary_at + (bufferViews[accessor.bufferView]?.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
  return {
    positions_m: new Float32Array(file, start(positions), 3 * positions.count),
    indices: new Uint32Array(file, start(corners), corners.count),
  };
}
