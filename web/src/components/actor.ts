/** Display name of the person or program that did something. */

import { text } from "../text";

/** Actor written by the server if an API client gave no name. */
const WITHOUT_NAME = "rest";

export function actorName(actor: string): string {
  return actor === WITHOUT_NAME ? text.value.common.by_api : actor;
}
