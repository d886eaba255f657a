/** Comparison of two scans. */
export const compare = {
  title: "Comparison of two scans",
  needs_two: "A comparison needs two scans.",
  reference: "Compared with",
  as: "Comparison",
  side_by_side: "Side by side",
  difference: "Difference",
  difference_hint:
    "Coloured by the distance from the surface of the other scan, positive towards the camera. Grey: the other scan has no surface there, or an edge.",
  caption: (name: string, when: string) => `${name} · ${when}`,
  to_result: (name: string) => `Result of ${name}`,
};
