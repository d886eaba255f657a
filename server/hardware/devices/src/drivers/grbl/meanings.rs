//! Meanings of the firmware's alarm and error numbers, in our words.
//!
//! Sources: `doc/csv/alarm_codes_en_US.csv` and `doc/csv/error_codes_en_US.csv` of gnea/grbl (v1.1); numbers above them
//! differ: `alarms.h`, `errors.h` of grblHAL/core, `Error.cpp` and `Protocol.cpp` of bdring/FluidNC.

use super::Dialect;

/// Meaning of `ALARM:code`.
pub fn alarm_meaning(dialect: Dialect, code: u32) -> &'static str {
    match (dialect, code) {
        (Dialect::FluidNc, 10) => "the spindle does not answer",
        (Dialect::FluidNc, 11) => "an input was active when it started",
        (Dialect::FluidNc, 13) => "a hard stop was pressed",
        (Dialect::FluidNc, 14) => "it is not homed",
        (Dialect::FluidNc, 12 | 15..) => "a number unknown to this program",
        (Dialect::Grbl, 10) => "homing of a second motor failed",
        (Dialect::Grbl, 11..) => "a number unknown to this program",
        _ => common_alarm_meaning(code),
    }
}

fn common_alarm_meaning(code: u32) -> &'static str {
    match code {
        1 => "a limit switch was hit; the position is lost",
        2 => "a target lies outside the machine's travel; the position is kept",
        3 => "it was reset while moving; the position is lost",
        4 | 5 => "probing failed",
        6 => "homing was reset",
        7 => "the door was opened while homing",
        8 => "homing did not come free of its switch",
        9 => "homing did not find its switch",
        10 => "the emergency stop is pressed",
        11 => "it must be homed",
        12 => "a limit switch is held",
        13 => "the probe protection tripped",
        14 => "the spindle does not keep its speed",
        15 => "homing of a second motor failed",
        16 => "its self-test failed",
        17 => "a motor driver reports a fault",
        18 => "homing does not work",
        _ => "a number unknown to this program",
    }
}

/// Meaning of `error:code`.
pub fn error_meaning(code: u32) -> &'static str {
    match code {
        1 => "a word without a letter",
        2 => "a word without a good number",
        3 => "an unknown `$` command",
        4 => "a negative number where none may be",
        5 => "homing is not enabled ($22)",
        6 => "step pulses are too short",
        7 => "its settings memory could not be read",
        8 => "only possible while it is idle",
        9 => "locked by an alarm or a jog",
        10 => "soft limits need homing",
        11 => "the line is too long",
        12 => "more steps per second than it can make",
        13 => "the door is open",
        14 => "a stored line is too long",
        15 => "a jog outside the machine's travel",
        16 => "a jog with words that may not be in it",
        17 => "laser mode needs a power output",
        20 => "an unknown G-code word",
        21 => "two words of one group",
        22 => "no feed rate was given",
        23 => "a whole number is needed",
        24 | 26 | 31 | 32 | 35 | 36 => "axis words that do not fit",
        25 => "a word given twice",
        27 => "a bad line number",
        28 => "a value is missing",
        29 => "a coordinate system it does not have",
        30 => "G53 needs G0 or G1",
        33 | 34 => "a target it cannot go to",
        37 => "a tool offset on another axis",
        38 => "a tool number too high",
        45 => "a limit switch is held",
        46 => "it must be homed first",
        50 => "the emergency stop is pressed",
        79 => "only a reset helps after this alarm",
        _ => "a number unknown to this program",
    }
}
