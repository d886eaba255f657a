/** Loads the mesh of a scan into its view. */

import { CommandButton } from "../../components/command_button";
import { text } from "../../text";
import type { ResultState } from "./result_state";

export function MeshTool({ result }: { result: ResultState }) {
  if (!result.scan.cloud || result.view.mesh.value) return null;
  return <CommandButton command={result.loadMesh}>{text.value.result.show_mesh}</CommandButton>;
}
