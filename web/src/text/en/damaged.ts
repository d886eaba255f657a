/** Records that are not what was written. */
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
  hint: "It is not what was written: the disk may be failing. All other records were checked and are whole.",
  remedy: "restore the data folder from a backup, and see whether the disk is healthy",
  remedy_delete:
    "delete it if it can be made again, or restore the data folder from a backup; see whether the disk is healthy",
  delete_named: (id: string) => `Delete ${id}`,
  delete_question: (id: string) =>
    `Delete the damaged result ${id}, with its points and measurements? This cannot be undone. A backup may have it whole.`,
};
