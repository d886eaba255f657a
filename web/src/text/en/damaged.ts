/** Damaged records. */
export const damaged = {
  title: (n: number) =>
    n === 1 ? "A record is damaged and cannot be shown" : `${n} records are damaged and cannot be shown`,
  kinds: {
    job: "Job",
    capture: "Capture",
    calibration: "Calibration",
    activation: "Activation",
    scan: "Result",
    measurement: "Measurement",
    session: "Calibration session",
    event: "Event",
  } as Record<string, string>,
  hint: "The stored data does not match what was written: the disk may be failing. All other records were checked and are intact.",
  remedy: "restore the data folder from a backup, and check the disk",
  remedy_delete: "delete it if it can be recreated, or restore the data folder from a backup; check the disk",
  delete_named: (id: string) => `Delete ${id}`,
  delete_question: (id: string) =>
    `Delete the damaged result ${id}, with its points and measurements? This cannot be undone. A backup may still contain it.`,
};
