/** Reads the mesh of a scan from GLB as written by this server: one mesh, float positions, 32-bit indices. */

import { fieldOf } from "../../api/unknown";

export interface Mesh {
  /** x, y, z, interleaved, part frame, metres. */
  positions_m: Float32Array;
  /** Vertex indices of the triangles. */
  indices: Uint32Array;
}

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
/** Component types of glTF. */
const FLOAT = 5126;
const UNSIGNED_INT = 5125;

/** The mesh as views into the file; empty if the file contains none. */
export function meshFromGlb(file: ArrayBuffer): Mesh {
  const view = new DataView(file);
  if (file.byteLength < 20 || view.getUint32(0, true) !== MAGIC) throw new Error("the mesh is no GLB file");
  const text_bytes = view.getUint32(12, true);
  if (view.getUint32(16, true) !== JSON_CHUNK) throw new Error("the GLB file has no description");
  const text = new TextDecoder().decode(new Uint8Array(file, 20, text_bytes));
  const document: unknown = JSON.parse(text);
  const number = (...path: readonly (string | number)[]) => {
    const value = path.reduce<unknown>((parent, name) => fieldOf(parent, `${name}`), document);
    return typeof value === "number" ? value : undefined;
  };
  const positions = number("meshes", 0, "primitives", 0, "attributes", "POSITION");
  const corners = number("meshes", 0, "primitives", 0, "indices");
  if (positions === undefined || corners === undefined) {
    return { positions_m: new Float32Array(), indices: new Uint32Array() };
  }
  const type = (accessor: number) => number("accessors", accessor, "componentType");
  if (type(positions) !== FLOAT || type(corners) !== UNSIGNED_INT) {
    throw new Error("the GLB file has other number types than this viewer reads");
  }
  const binary_at = 20 + text_bytes + 8;
  const start = (accessor: number) => {
    const view = number("accessors", accessor, "bufferView") ?? -1;
    const in_view = number("accessors", accessor, "byteOffset") ?? 0;
    return binary_at + (number("bufferViews", view, "byteOffset") ?? 0) + in_view;
  };
  const count = (accessor: number) => number("accessors", accessor, "count") ?? 0;
  return {
    positions_m: new Float32Array(file, start(positions), 3 * count(positions)),
    indices: new Uint32Array(file, start(corners), count(corners)),
  };
}
