import type { compare as english } from "../en/compare";

export const compare: typeof english = {
  title: "Vergleich zweier Scans",
  needs_two: "Ein Vergleich braucht zwei Scans.",
  reference: "Verglichen mit",
  as: "Vergleich",
  side_by_side: "Nebeneinander",
  difference: "Differenz",
  difference_hint:
    "Gefärbt nach dem Abstand von der Oberfläche des anderen Scans, positiv zur Kamera hin. Grau: Der andere Scan hat dort keine Oberfläche oder eine Kante.",
  caption: (name, when) => `${name} · ${when}`,
  to_result: (name) => `Ergebnis von ${name}`,
};
