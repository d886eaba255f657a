type Step = readonly ["calibration" | "live" | "scan" | "operate" | "results" | "health", string];

export const help = {
  title: "Help",
  contents: "Contents",
  first: "First steps",
  first_steps: [
    [
      "calibration",
      "press Calibrate now, wait until it is done, then activate the calibration. Nothing can be measured without one.",
    ],
    [
      "live",
      "check the camera image and the lines; set the exposure so that the lines are bright but not saturated.",
    ],
    ["operate", "place the part on the stage, type or scan its serial number, then press Start scan."],
    ["scan", "set range and step yourself and watch the point cloud grow."],
    ["results", "open a result, compare parts over time, download points."],
    ["health", "when something seems wrong: anything that is not grey needs attention."],
  ] as readonly Step[],
  simulated:
    "A blue frame and the word Simulation mean simulated data: the station computes its images instead of capturing them. Everything else works as it does on a real station.",
  states: "What the states mean",
  state: "State",
  means: "Meaning",
  state_means: {
    Preoperational: "The service is starting, or a device is missing; Health shows which one.",
    "Operational.Initialized": "The devices respond, but no calibration is active or the stage is not homed.",
    "Operational.Ready": "A scan can start.",
    "Operational.SingleExecution": "A job uses the station. Manual commands are refused until it ends.",
    "Operational.ContinuousExecution": "The camera runs for the live view. A job may start at any time.",
    Halted: "Someone pressed Stop. Motion and laser stay off until reset.",
    Error: "A device failed. Fix the cause, then acknowledge and reset.",
  } as Record<string, string>,
  verdicts: "What the verdicts mean",
  verdict_means: {
    ok: "The value is inside the tolerance by more than its uncertainty U (ISO 14253-1).",
    not_ok: "The value is outside the tolerance by more than U.",
    undecided: "A tolerance limit is within ± U of the value: too close to the limit to decide.",
    invalid:
      "No verdict possible: something could not be measured, or frames were lost during the scan. Treat the part as a reject and scan it again.",
    measured: "There is a value but no tolerance, so there is no verdict.",
  },
  stop: "Laser and Stop",
  stop_rules: [
    "Stop works on every page, for everyone, with or without control, and never asks for confirmation. Keys: Ctrl + . or Pause.",
    "Stop halts the stage and turns the laser off; both stay off until reset. A running scan keeps the rows captured so far and can be resumed.",
    "Nothing restarts automatically after Stop: a person has to reset the station.",
    "The laser is on only during a job or the live view. It turns off when frames stop arriving, when the service ends, and on every fault.",
    "Where the laser shows “not controlled here”, it is on as long as it is supplied with power; none of the above turns it off.",
    "Stop is not an emergency stop: it depends on this page, the network and the server. Use the emergency stop of the machine when someone is in danger.",
    "One page is in control at a time. Jobs need no control; manual commands take it, and anyone can take it over.",
  ],
  shortcuts: "Keyboard shortcuts",
  keys: "Keys",
  does: "Action",
  shortcut_keys: [
    ["Ctrl + .", "Stop"],
    ["Pause", "Stop"],
    ["?", "These shortcuts"],
    ["Tab", "Next element; Shift + Tab goes back"],
    ["Enter", "Presses a button; in the serial number field: starts the scan"],
    ["Esc", "Closes a dialog"],
  ] as readonly (readonly [string, string])[],
  letters_hint:
    "On the Operate page, letters always go into the serial number, so that a barcode scanner works at any time. Single-letter shortcuts can be turned off:",
  api: "API",
  api_hint: "Everything this page does goes through the public API.",
  openapi: "the API as an OpenAPI document",
  first_job: "shows the command for a first job while there are no jobs",
  about: "About",
  libraries: "This page contains these libraries, all under the MIT licence:",
  licence_text: "MIT licence",
};
