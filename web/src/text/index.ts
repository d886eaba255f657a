/** The language of the page. */

import { computed } from "@preact/signals";
import { remembered } from "../state/browser/remembered";
import { de } from "./de";
import { type Catalogue, en } from "./en";

export const LANGUAGE_CODES = ["en", "de"] as const;
export type Language = (typeof LANGUAGE_CODES)[number];

export const LANGUAGES: Record<Language, string> = { en: "English", de: "Deutsch" };

const CATALOGUES: Record<Language, Catalogue> = { en, de };

function preferred(): Language {
  return typeof navigator !== "undefined" && navigator.language.startsWith("de") ? "de" : "en";
}

/** The chosen language, also of numbers and dates. */
export const language = remembered("language", preferred(), LANGUAGE_CODES);

/** The texts in the chosen language; components that read it update when the language changes. */
export const text = computed(() => CATALOGUES[language.value] ?? en);
