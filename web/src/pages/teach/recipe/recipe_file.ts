/** The file of a recipe, as exported by a station. */

import { type Problem, ProblemError, type Schemas } from "../../../api/client";
import { fieldOf, textOf } from "../../../api/unknown";
import { text } from "../../../text";

type RecipeFile = Schemas["RecipeFileDto"];

const FORMAT: RecipeFile["format"] = "sheaf-recipe/1";

/** Reads the content of a file; throws a `ProblemError` if it is not the file of a recipe. */
export function recipeFile(content: string): RecipeFile {
  const file = parsed(content);
  if (!isRecipeFile(file)) throw new ProblemError(notARecipe());
  return file;
}

function parsed(content: string): unknown {
  try {
    return JSON.parse(content);
  } catch {
    return undefined;
  }
}

/** Whether it is meant to be a recipe; the server checks the content. */
function isRecipeFile(file: unknown): file is RecipeFile {
  return fieldOf(file, "format") === FORMAT && textOf(file, "id") !== undefined;
}

function notARecipe(): Problem {
  const { import_wrong: title, import_wrong_detail: detail, import_wrong_remedy: remedy } = text.value.teach;
  return { type: "urn:sheaf:problem:page", title, status: 0, detail, remedy };
}
