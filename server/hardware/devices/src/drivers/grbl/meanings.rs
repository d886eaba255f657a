//! Meanings of the firmware's alarm and error numbers, in plain English.
//!
//! Sources: `doc/csv/alarm_codes_en_US.csv` and `doc/csv/error_codes_en_US.csv` of gnea/grbl (v1.1); numbers above them
//! differ: `alarms.h`, `errors.h` of grblHAL/core, `Error.cpp` and `Protocol.cpp` of bdring/FluidNC.

use super::Dialect;

/// Meaning of `ALARM:code`.
pub fn alarm_meaning(dialect: Dialect, code: u32) -> &'static str {
    match (dialect, code) {
        (Dialect::FluidNc, 10) => "the spindle does not respond",
        (Dialect::FluidNc, 11) => "an input was active when it started",
        (Dialect::FluidNc, 13) => "a hard stop was pressed",
        (Dialect::FluidNc, 14) => "it is not homed",
        (Dialect::FluidNc, 12 | 15..) => "unknown code",
        (Dialect::Grbl, 10) => "homing of a second motor failed",
        (Dialect::Grbl, 11..) => "unknown code",
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
        8 => "homing could not clear the limit switch during pull-off",
        9 => "homing did not find the limit switch",
        10 => "the emergency stop is pressed",
        11 => "homing is required",
        12 => "a limit switch is engaged",
        13 => "the probe protection tripped",
        14 => "the spindle does not keep its speed",
        15 => "homing of a second motor failed",
        16 => "its self-test failed",
        17 => "a motor driver reports a fault",
        18 => "homing failed",
        _ => "unknown code",
    }
}

/// Meaning of `error:code`.
pub fn error_meaning(code: u32) -> &'static str {
    match code {
        1 => "a G-code word without a letter",
        2 => "a G-code word with an invalid number",
        3 => "an unknown `$` command",
        4 => "a negative value where a positive one is expected",
        5 => "homing is not enabled ($22)",
        6 => "step pulses are too short",
        7 => "the settings memory (EEPROM) could not be read",
        8 => "only possible while it is idle",
        9 => "locked by an alarm or a jog",
        10 => "soft limits require homing",
        11 => "the line is too long",
        12 => "step rate above the maximum",
        13 => "the door is open",
        14 => "a stored line is too long",
        15 => "a jog outside the machine's travel",
        16 => "a jog command with invalid G-code words",
        17 => "laser mode requires a PWM output",
        20 => "an unknown G-code word",
        21 => "two G-code words of the same modal group",
        22 => "no feed rate was given",
        23 => "an integer is required",
        24 | 26 | 31 | 32 | 35 | 36 => "missing or unexpected axis words",
        25 => "a repeated G-code word",
        27 => "an invalid line number",
        28 => "a value is missing",
        29 => "an unsupported work coordinate system",
        30 => "G53 requires G0 or G1",
        33 | 34 => "an invalid target",
        37 => "a tool offset on another axis",
        38 => "a tool number above the maximum",
        45 => "a limit switch is engaged",
        46 => "homing is required first",
        50 => "the emergency stop is pressed",
        79 => "only a reset helps after this alarm",
        _ => "unknown code",
    }
}
