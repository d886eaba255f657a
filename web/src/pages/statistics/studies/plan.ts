/** What is typed for a new study, and the plan that it gives. Lengths in mm; limits are typed in µm. */

import type { Schemas } from "../../../api/client";
import type { en } from "../../../text/en";

export const KINDS = ["acceptance", "type_1", "gauge_rr"] as const;
export type Kind = (typeof KINDS)[number];

export const PROCEDURES = ["sphere", "sphere_pair", "plate", "linearity", "repeatability"] as const;
export type Procedure = (typeof PROCEDURES)[number];

type Quantity = Schemas["QuantityCodeDto"];

/** The quantities with a limit, by procedure. */
export const QUANTITIES: Record<Procedure, readonly Quantity[]> = {
  sphere: ["probing_form", "probing_form_d95", "probing_size"],
  sphere_pair: ["sphere_spacing"],
  plate: ["flatness", "flatness_d95"],
  linearity: ["linearity"],
  repeatability: ["repeatability_single", "repeatability_averaged"],
};

/** The calibrated values of an artefact, by procedure. */
export const VALUES = {
  sphere: ["diameter", "uncertainty", "form"],
  sphere_pair: ["distance", "uncertainty", "ball_diameter"],
  plate: ["form"],
  linearity: ["uncertainty"],
  repeatability: [],
} as const satisfies Record<Procedure, readonly string[]>;
export type Value = (typeof VALUES)[Procedure][number];

/** An artefact as typed. */
export interface DraftArtefact {
  artefact: string;
  /** Sizes in mm; uncertainty and form in µm. */
  values: Partial<Record<Value, number>>;
  /** Limits in µm. */
  limits: Partial<Record<Quantity, number>>;
}

export interface Draft {
  kind: Kind;
  name: string;
  /** The procedures of an acceptance test. */
  artefacts: Partial<Record<Procedure, DraftArtefact>>;
  recipe: string;
  characteristic: string;
  serial: string;
  reference: number | undefined;
  n_values: number;
  /** Separated by commas. */
  parts: string;
  operators: string;
  n_trials: number;
}

export const EMPTY_ARTEFACT: DraftArtefact = { artefact: "", values: {}, limits: {} };

export const EMPTY_DRAFT: Draft = {
  kind: "acceptance",
  name: "",
  artefacts: { sphere: EMPTY_ARTEFACT },
  recipe: "",
  characteristic: "",
  serial: "",
  reference: undefined,
  n_values: 50,
  parts: "",
  operators: "",
  n_trials: 3,
};

/** The query of the URL at which a gauge R&R study of a characteristic is planned. */
export function gaugeRrQuery(recipe: string, characteristic: string): Record<string, string> {
  return { kind: "gauge_rr", recipe, characteristic };
}

/** What the query of the URL proposes for a new study. */
export function draftOf(query: URLSearchParams): Draft {
  const kind = KINDS.find((kind) => kind === query.get("kind")) ?? EMPTY_DRAFT.kind;
  const [recipe, characteristic] = [query.get("recipe") ?? "", query.get("characteristic") ?? ""];
  return { ...EMPTY_DRAFT, kind, recipe, characteristic };
}

/** Names separated by commas. */
export function namesIn(list: string): string[] {
  return list
    .split(",")
    .map((name) => name.trim())
    .filter((name) => name !== "");
}

/** The first thing that is missing, as a sentence. */
export function wrongWith(draft: Draft, words: (typeof en)["studies"]): string | undefined {
  if (draft.name.trim() === "") return words.name_missing;
  if (draft.kind === "acceptance") return wrongWithArtefacts(draft, words);
  if (draft.recipe === "") return words.no_recipes;
  if (draft.kind === "gauge_rr") return namesIn(draft.parts).length < 2 ? words.parts_missing : undefined;
  if (draft.serial.trim() === "") return words.serial_missing;
  return draft.reference === undefined ? words.reference_missing : undefined;
}

function wrongWithArtefacts({ artefacts }: Draft, words: (typeof en)["studies"]): string | undefined {
  const planned = PROCEDURES.filter((procedure) => artefacts[procedure] !== undefined);
  if (planned.length === 0) return words.limits_missing;
  for (const procedure of planned) {
    const { artefact, values, limits } = artefacts[procedure] ?? EMPTY_ARTEFACT;
    if (artefact.trim() === "") return words.artefact_missing;
    if (VALUES[procedure].some((name) => values[name] === undefined)) return words.values_missing;
    if (QUANTITIES[procedure].every((quantity) => limits[quantity] === undefined)) return words.limits_missing;
  }
  return undefined;
}

/** The plan for the server. */
export function planOf(draft: Draft): Schemas["StudyPlanDto"] {
  const { recipe, characteristic } = draft;
  if (draft.kind === "acceptance") return { acceptance: acceptanceOf(draft.artefacts) };
  if (draft.kind === "type_1") {
    const { reference = 0, n_values } = draft;
    const serial = draft.serial.trim();
    return { type_1: { recipe, characteristic, serial, reference, n_values, n_sigmas: 6 } };
  }
  const [parts, operators] = [namesIn(draft.parts), namesIn(draft.operators)];
  return { gauge_rr: { recipe, characteristic, parts, operators, n_trials: draft.n_trials } };
}

/** Thermal expansion of artefacts, 1/K: steel, the default of the server. */
const EXPANSION_PER_K = 11.5e-6;

const mm = (um: number | undefined): number => (um ?? 0) / 1e3;

function acceptanceOf(artefacts: Draft["artefacts"]): Schemas["AcceptancePlan"] {
  const limit = (name: string, um: number | undefined) => (um === undefined ? {} : { [name]: mm(um) });
  const { sphere, sphere_pair, plate, linearity, repeatability } = artefacts;
  return {
    ...(sphere && {
      sphere: {
        artefact: sphere.artefact.trim(),
        diameter_mm: sphere.values.diameter ?? 0,
        uncertainty_mm: mm(sphere.values.uncertainty),
        form_mm: mm(sphere.values.form),
        expansion_per_k: EXPANSION_PER_K,
        ...limit("mpe_form_mm", sphere.limits.probing_form),
        ...limit("mpe_form_d95_mm", sphere.limits.probing_form_d95),
        ...limit("mpe_size_mm", sphere.limits.probing_size),
      },
    }),
    ...(sphere_pair && {
      sphere_pair: {
        artefact: sphere_pair.artefact.trim(),
        distance_mm: sphere_pair.values.distance ?? 0,
        uncertainty_mm: mm(sphere_pair.values.uncertainty),
        diameter_mm: sphere_pair.values.ball_diameter ?? 0,
        expansion_per_k: EXPANSION_PER_K,
        ...limit("mpe_spacing_mm", sphere_pair.limits.sphere_spacing),
      },
    }),
    ...(plate && {
      plate: {
        artefact: plate.artefact.trim(),
        form_mm: mm(plate.values.form),
        ...limit("mpe_flatness_mm", plate.limits.flatness),
        ...limit("mpe_flatness_d95_mm", plate.limits.flatness_d95),
      },
    }),
    ...(linearity && {
      linearity: {
        artefact: linearity.artefact.trim(),
        uncertainty_mm: mm(linearity.values.uncertainty),
        ...limit("mpe_linearity_mm", linearity.limits.linearity),
      },
    }),
    ...(repeatability && {
      repeatability: {
        artefact: repeatability.artefact.trim(),
        ...limit("mpe_single_mm", repeatability.limits.repeatability_single),
        ...limit("mpe_averaged_mm", repeatability.limits.repeatability_averaged),
      },
    }),
  };
}
