/** The theme: the user's choice, else the system preference. */

import { computed, signal } from "@preact/signals";
import { remembered } from "./remembered";

export const THEMES = ["system", "light", "dark"] as const;
export type ThemeChoice = (typeof THEMES)[number];

export const theme_choice = remembered<ThemeChoice>("theme", "system", THEMES);

const query = typeof matchMedia === "undefined" ? undefined : matchMedia("(prefers-color-scheme: dark)");
const system_dark = signal(query?.matches ?? false);
query?.addEventListener("change", (event) => {
  system_dark.value = event.matches;
});

/** The current theme. */
export const theme = computed<"light" | "dark">(() => {
  if (theme_choice.value !== "system") return theme_choice.value;
  return system_dark.value ? "dark" : "light";
});
