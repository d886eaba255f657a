/** Work that is wanted often and worth doing once. */

/** Begins `work` at once; wanted while it goes on, it is done once more afterwards, however often it was wanted. */
export function coalesced(work: () => Promise<void>): () => Promise<void> {
  let going_on: Promise<void> | undefined;
  let again = false;
  const run = async () => {
    do {
      again = false;
      await work();
    } while (again);
  };
  return () => {
    again = true;
    going_on ??= run().finally(() => {
      going_on = undefined;
    });
    return going_on;
  };
}
