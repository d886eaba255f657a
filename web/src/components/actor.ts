/** Display name of the person or program that did something. */

import { text } from "../text";

/** Actor written by the server if an API client gave no name. */
const UNNAMED_CLIENT = "rest";

export function actorName(actor: string): string {
  return actor === UNNAMED_CLIENT ? text.value.common.by_api : actor;
}
