/** The settings of a recipe beside its plan, while they are edited. */

import { batch, computed, type Signal, signal } from "@preact/signals";
import type { Schemas } from "../../../api/client";
import { type AttributeFault, type AttributeRow, attributesOf, rowFault, rowsOf, withRow } from "./attributes";
import { draftOf, draftOfRun, type ScanDraft, type ScanFault, scanFault, settingsOf } from "./scan_draft";

export type Recipe = Schemas["RecipeDto"];

/** Why the settings cannot be published. */
export type SettingsFault = "broken_pattern" | AttributeFault | ScanFault;

export class RecipeSettings {
  /** Display name; that of a new recipe is its id if it is empty. */
  readonly name = signal("");
  /** Number by which a PLC selects it. */
  readonly number = signal<number | undefined>(undefined);
  /** Regular expression for whole serial numbers; none if it is empty. */
  readonly serial_pattern = signal("");
  readonly scan: Signal<ScanDraft>;
  /** Names of the doors that receive the results; `undefined`: every door that delivers inspections. */
  readonly outputs = signal<readonly string[] | undefined>(undefined);
  readonly attributes = signal<readonly AttributeRow[]>([]);
  /** Number of starts: fields are made anew with each, without what was typed before. */
  readonly n_starts = signal(0);
  readonly pattern_is_broken = computed(() => isBroken(this.serial_pattern.value));
  readonly fault = computed<SettingsFault | undefined>(() => {
    if (this.pattern_is_broken.value) return "broken_pattern";
    const rows = this.attributes.value;
    return rows.map((one) => rowFault(rows, one)).find(Boolean) ?? scanFault(this.scan.value);
  });

  /** `run`: the scan on which it is taught; a new recipe scans as it did. */
  constructor(private readonly run: Schemas["ScanRunDto"]) {
    this.scan = signal(draftOfRun(run));
  }

  /** Starts from the content of a recipe, or from the scan. */
  start(recipe: Recipe | undefined): void {
    batch(() => {
      this.name.value = recipe?.name ?? "";
      this.number.value = recipe?.number ?? undefined;
      this.serial_pattern.value = recipe?.serial_pattern ?? "";
      this.scan.value = recipe ? draftOf(recipe.scan) : draftOfRun(this.run);
      this.outputs.value = recipe?.outputs ?? undefined;
      this.attributes.value = rowsOf(recipe?.attributes);
      this.n_starts.value += 1;
    });
  }

  /** The content of a recipe without its plan; what is empty is absent. `id`: its name if it has no other. */
  content(id: string): Omit<Recipe, "plan"> {
    const [name, number, serial_pattern] = [this.name.peek(), this.number.peek(), this.serial_pattern.peek()];
    const [outputs, attributes] = [this.outputs.peek(), attributesOf(this.attributes.peek())];
    return {
      name: name.trim() === "" ? id : name,
      ...(number !== undefined && { number }),
      ...(serial_pattern.trim() !== "" && { serial_pattern }),
      scan: settingsOf(this.scan.peek()),
      ...(outputs && { outputs: [...outputs] }),
      ...(Object.keys(attributes).length > 0 && { attributes }),
    };
  }

  changeScan(part: Partial<ScanDraft>): void {
    this.scan.value = { ...this.scan.peek(), ...part };
  }

  /** Whether a door receives the results, if not every door does. */
  setOutput(door: string, receives: boolean): void {
    const others = (this.outputs.peek() ?? []).filter((name) => name !== door);
    this.outputs.value = receives ? [...others, door] : others;
  }

  /** Adds an empty attribute; returns the number of its row. */
  addAttribute(): number | undefined {
    this.attributes.value = withRow(this.attributes.peek());
    return this.attributes.peek().at(-1)?.row;
  }

  changeAttribute(row: number, part: Partial<Pick<AttributeRow, "name" | "value">>): void {
    this.attributes.value = this.attributes.peek().map((one) => (one.row === row ? { ...one, ...part } : one));
  }

  removeAttribute(row: number): void {
    this.attributes.value = this.attributes.peek().filter((one) => one.row !== row);
  }
}

/** Syntax in which the regular expressions of the server differ from those of browsers: the server checks it. */
const SERVER_SYNTAX = /\(\?|[*+?}^$bB][*+?{]/;

/** Whether a pattern is certainly not a regular expression, such as one with an open bracket. */
function isBroken(pattern: string): boolean {
  if (SERVER_SYNTAX.test(pattern)) return false;
  try {
    new RegExp(pattern);
    return false;
  } catch {
    return true;
  }
}
