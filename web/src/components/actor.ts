/** Who did something: a person by name, or a program. */

import { text } from "../text";

/** What the server writes where a program gave no name. */
const WITHOUT_NAME = "rest";

export function actorName(actor: string): string {
  return actor === WITHOUT_NAME ? text.value.common.by_api : actor;
}
