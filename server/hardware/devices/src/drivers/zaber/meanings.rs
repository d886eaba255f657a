//! Meanings of the firmware's flags and reasons, in our text.
//!
//! Source: Zaber's "ASCII Protocol Manual", warning flags and reasons for rejected commands.

/// Severity of a warning flag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// No consequence.
    Note,
    /// The position is lost: the axis must be homed.
    Unreferenced,
    /// The motion was interrupted.
    Interrupted,
    /// A fault, until the cause is removed and the flag cleared.
    Fault,
}

/// Severity and meaning of a flag.
pub fn flag_meaning(flag: &str) -> (Severity, &'static str) {
    match flag {
        "--" => (Severity::Note, "no warning"),
        "WR" => (Severity::Unreferenced, "it has no reference position"),
        "WH" => (Severity::Unreferenced, "it has not been homed since power-up"),
        "FF" => (Severity::Fault, "its system failed; it needs service"),
        "FN" => (Severity::Fault, "it does not support the connected stage"),
        "FZ" => (Severity::Fault, "the axis is not active: its stage was changed"),
        "FH" => (Severity::Fault, "its emergency stop is pressed"),
        "FV" => (Severity::Fault, "its supply voltage is too low or too high"),
        "FO" => (Severity::Fault, "its motor driver is switched off"),
        "FC" => (Severity::Fault, "its motor driver was switched off: too much current"),
        "FM" => (Severity::Fault, "its motor driver was switched off: too hot"),
        "FD" => (Severity::Fault, "its motor driver was disabled"),
        "FQ" => (Severity::Fault, "its encoder failed; the position may be wrong"),
        "FS" => (Severity::Fault, "it stalled"),
        "FT" => (Severity::Fault, "the lockstep axes exceed their maximum twist"),
        "FB" => (Severity::Fault, "a motion was interrupted by a fault"),
        "FP" => (Severity::Fault, "a motion was interrupted because it exceeded its limits"),
        "FE" => (Severity::Fault, "it hit a limit of its travel"),
        "WL" => (Severity::Fault, "it hit a limit switch it did not expect; the position may be wrong"),
        "WM" => (Severity::Fault, "it was moved while at rest; the position may be wrong"),
        "WP" => (Severity::Fault, "its calibration type is not supported; the position may be wrong"),
        "NC" => (Severity::Interrupted, "manual control: it is moved by its knob"),
        "NI" => (Severity::Interrupted, "another command or the knob interrupted the motion"),
        _ if flag.starts_with('F') => (Severity::Fault, "an unknown fault"),
        _ => (Severity::Note, "an unknown note"),
    }
}

/// Reason for the rejection of a motion while the motor is without current.
pub const DRIVER_OFF: &str = "DRIVERDISABLED";

/// Meaning of a reason after `RJ`.
pub fn reason_meaning(reason: &str) -> &'static str {
    match reason {
        "AGAIN" => "not possible at present; try again later",
        "BADAXIS" => "it has no such axis",
        "BADCOMMAND" => "an unknown command or setting",
        "BADDATA" => "a value out of range, or a target outside the travel",
        "BADMESSAGE" => "the line was received damaged",
        "BADSPACE" => "an unknown group or space",
        "DEVICEONLY" => "a command for the device, not for an axis",
        DRIVER_OFF => "its motor driver is switched off",
        "FULL" => "its buffer is full",
        "INACTIVE" => "the axis is not active",
        "LOCKSTEPAXES" => "the axis moves in lockstep with another",
        "NOACCESS" => "not permitted at this access level",
        "PARKED" => "it is parked; send `tools parking unpark`",
        "STATUSBUSY" => "only possible while it is idle",
        _ => "an unknown reason",
    }
}
