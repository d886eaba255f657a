/** STL files, and parts from them on the table of the simulated station. */

import type { Server } from "./server";

/** Position, mm. */
export type Corner = readonly [number, number, number];
export type Triangle = readonly [Corner, Corner, Corner];

/** An STL file in its text form. */
export function stlOf(triangles: readonly Triangle[]): string {
  const vertex = (corner: Corner) => `vertex ${corner.map((mm) => mm.toFixed(6)).join(" ")}\n`;
  const facets = triangles.map(
    (corners) => `facet normal 0 0 0\nouter loop\n${corners.map(vertex).join("")}endloop\nendfacet\n`,
  );
  return `solid part\n${facets.join("")}endsolid part\n`;
}

/** Puts a part on the stage. */
export async function placePart(server: Server, stl: string): Promise<void> {
  const answer = await fetch(`${server.url}/api/v1/simulation/scene/part`, {
    method: "PUT",
    headers: { "content-type": "model/stl" },
    body: stl,
  });
  if (!answer.ok) throw new Error(await answer.text());
}

/** Height of a surface above a place, mm. */
type Height = (x_mm: number, y_mm: number) => number;

/** Half the length and width of the curved part, and the distance of its corners, mm. */
const [HALF_X_MM, HALF_Y_MM, GRID_MM] = [24, 10, 1];

/** The top of the curved part as a surface with an open rim; `margin_mm`: how much is left out along it. */
export function curvedSurface(height: Height, margin_mm: number): readonly Triangle[] {
  const [half_x, half_y] = [HALF_X_MM - margin_mm, HALF_Y_MM - margin_mm];
  const at = (x: number, y: number): Corner => [x, y, height(x, y)];
  const found: Triangle[] = [];
  for (let x = -half_x; x < half_x; x += GRID_MM) {
    for (let y = -half_y; y < half_y; y += GRID_MM) {
      const [a, b] = [at(x, y), at(x + GRID_MM, y)];
      const [c, d] = [at(x + GRID_MM, y + GRID_MM), at(x, y + GRID_MM)];
      found.push([a, b, c], [a, c, d]);
    }
  }
  return found;
}

/** The drawing: curved in both directions, so that the points determine all degrees of freedom of a best fit. */
export const nominalHeight: Height = (x, y) => 6 + 2 * Math.sin(x / 5) + 1.5 * Math.cos(y / 4 + x / 9);

/** The part: with a bump and a dent. */
export function realHeight(defect_mm: number): Height {
  const hill = (x: number, y: number) => Math.exp(-(x * x + y * y) / 8);
  return (x, y) => nominalHeight(x, y) + defect_mm * (hill(x - 8, y - 2) - hill(x + 8, y + 2));
}
