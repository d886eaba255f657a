//! Parser of the lines of Marlin, and formatting of commands with number and checksum.
//!
//! Sources: the G-code reference of marlinfw.org; `queue.cpp`, `M114.cpp`, `M115.cpp`, `serial.h` of
//! MarlinFirmware/Marlin 2.x.

/// A line from the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// After power-on or reset.
    Start,
    /// The oldest pending line was accepted; with its number, if the firmware states it.
    Ok(Option<u32>),
    /// The line of this number is requested again.
    Resend(u32),
    /// It is executing a line that takes time.
    Busy,
    /// Answer to `M114`.
    Position(Position),
    /// It halted permanently.
    Halted(String),
    /// An error.
    Error(String),
    /// Unknown command.
    Unknown(String),
    /// An endstop was hit during a move.
    EndstopHit(String),
    /// `Cap:name:value`.
    Capability(String, bool),
    /// Text that answers `M115`, `M211` or `M503`, or has no meaning here; without its `echo:`.
    Text(String),
    /// Not part of the protocol.
    Garbage(String),
}

/// A position, by the first three axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// End of the last planned move, mm.
    pub planned_mm: [f64; 3],
    /// Position of the motors, steps.
    pub steps: [i64; 3],
}

/// A command with its number, checksum and line end.
pub fn numbered(number: u32, command: &str) -> String {
    let line = format!("N{number} {command}");
    let checksum = line.bytes().fold(0_u8, |sum, byte| sum ^ byte);
    format!("{line}*{checksum}\n")
}

/// Prefixes of text lines: echoes, firmware data, reports of temperature and settings.
const TEXTS: [&str; 12] = [
    "echo:",
    "//",
    "FIRMWARE_NAME:",
    "area:",
    "wait",
    "T:",
    " T:",
    "Marlin",
    "DEBUG:",
    "Soft endstops",
    ";",
    "Last Updated",
];

/// Parses one line, without its line ending.
pub fn message_from_line(received: &str) -> Message {
    let garbage = || Message::Garbage(crate::lines::line_reader::shortened(received));
    let line = received.trim();
    if !line.bytes().all(|byte| (0x20..0x7f).contains(&byte)) {
        return garbage();
    }
    if line == "start" {
        return Message::Start;
    }
    if let Some(ok) = ok_from(line) {
        return ok;
    }
    let number_after = |key: &str| line.strip_prefix(key).map(|rest| rest.trim().parse::<u32>());
    if let Some(number) = number_after("Resend:").or_else(|| number_after("rs ")) {
        return number.map_or_else(|_| garbage(), Message::Resend);
    }
    if let Some(text) = line.strip_prefix("Error:") {
        let halted = ["kill()", "halted", "system stopped"].iter().any(|word| text.contains(word));
        return match text {
            // `Resend` follows.
            _ if text.contains("Last Line:") => Message::Text(text.to_owned()),
            _ if halted => Message::Halted(text.to_owned()),
            _ => Message::Error(text.to_owned()),
        };
    }
    if let Some(text) = line.strip_prefix("echo:") {
        return match text {
            _ if text.starts_with("busy:") => Message::Busy,
            _ if text.starts_with("Unknown command:") => Message::Unknown(text.to_owned()),
            _ if text.starts_with("endstops hit:") => Message::EndstopHit(text.to_owned()),
            _ => Message::Text(text.trim().to_owned()),
        };
    }
    if let Some(rest) = line.strip_prefix("Cap:") {
        return match rest.split_once(':') {
            Some((name, value @ ("0" | "1"))) => Message::Capability(name.to_owned(), value == "1"),
            _ => garbage(),
        };
    }
    if line.starts_with("X:") {
        return position_from(line).map_or_else(garbage, Message::Position);
    }
    let is_setting = line.len() > 3
        && matches!(line.as_bytes()[0], b'M' | b'G')
        && line.as_bytes()[1].is_ascii_digit()
        && line.contains(' ');
    if line.is_empty() || is_setting || TEXTS.iter().any(|begin| line.starts_with(begin)) {
        return Message::Text(line.to_owned());
    }
    garbage()
}

/// `ok`, or with `ADVANCED_OK` `ok N12 P15 B3`.
fn ok_from(line: &str) -> Option<Message> {
    let rest = line.strip_prefix("ok")?;
    if !rest.is_empty() && !rest.starts_with(' ') {
        return None;
    }
    let mut number = None;
    for word in rest.split_whitespace() {
        let value = word.get(1..)?.parse::<u32>().ok();
        match word.as_bytes()[0] {
            b'N' => number = Some(value?),
            b'P' | b'B' => drop(value?),
            _ => return None,
        }
    }
    Some(Message::Ok(number))
}

/// `X:10.00 Y:0.00 Z:0.00 E:0.00 Count X:800 Y:0 Z:0`; `None` if any of it is missing.
fn position_from(line: &str) -> Option<Position> {
    let (planned, steps) = line.split_once(" Count ")?;
    let of_axes = |text: &str| {
        // Some versions put a space after the colon.
        let text = text.replace(": ", ":");
        let value = |letter: &str| -> Option<f64> {
            let word = text.split_whitespace().find_map(|word| word.strip_prefix(letter)?.strip_prefix(':'))?;
            word.parse().ok().filter(|value: &f64| value.is_finite())
        };
        Some([value("X")?, value("Y")?, value("Z")?])
    };
    let steps = of_axes(steps)?;
    let whole = steps.iter().all(|step| step.fract() == 0.0);
    whole.then_some(Position { planned_mm: of_axes(planned)?, steps: steps.map(|step| step as i64) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_carries_its_number_and_the_xor_of_its_bytes() {
        assert_eq!(numbered(3, "T0"), "N3 T0*57\n");
        assert_eq!(numbered(4, "G92 E0"), "N4 G92 E0*67\n");
    }

    #[test]
    fn lines_of_the_firmware_are_read() {
        let check = |line: &str, expected: Message| assert_eq!(message_from_line(line), expected, "{line}");
        check("start", Message::Start);
        check("ok", Message::Ok(None));
        check("ok N12 P15 B3", Message::Ok(Some(12)));
        check("Resend: 12", Message::Resend(12));
        check("rs 12", Message::Resend(12));
        check("echo:busy: processing", Message::Busy);
        check(
            "X:10.00 Y:0.00 Z:0.00 E:0.00 Count X:800 Y:0 Z:0",
            Message::Position(Position { planned_mm: [10.0, 0.0, 0.0], steps: [800, 0, 0] }),
        );
        check(
            "X:0.00 Y:127.20 Z:145.14 E:0.00 Count X: 0 Y:10160 Z:116000",
            Message::Position(Position { planned_mm: [0.0, 127.2, 145.14], steps: [0, 10160, 116_000] }),
        );
        check("Cap:EMERGENCY_PARSER:1", Message::Capability("EMERGENCY_PARSER".into(), true));
        check("echo:  M92 X80.00 Y80.00", Message::Text("M92 X80.00 Y80.00".into()));
        check("  M92 X80.00 Y80.00", Message::Text("M92 X80.00 Y80.00".into()));
        let halted = "Error:Printer halted. kill() called!";
        check(halted, Message::Halted(halted["Error:".len()..].into()));
        check(
            "Error:Line Number is not Last Line Number+1, Last Line: 5",
            Message::Text("Line Number is not Last Line Number+1, Last Line: 5".into()),
        );
    }

    #[test]
    fn half_lines_and_noise_are_not_the_protocol() {
        for line in [
            "X:10.00 Y:0.00 Z:0.00 E:0.00 Count X:8",
            "X:10.00 Y:0.00 Z:0.00 E:0.00 Co",
            "X:10.00 Y:0.00 Z:0.00 E:0.00 Count X:80.5 Y:0 Z:0",
            "okk",
            "o",
            "ok N",
            "Resend: x",
            "Count X:800 Y:0 Z:0",
            "\u{fffd}ok",
            "Grbl 1.1h ['$' for help]",
        ] {
            assert!(matches!(message_from_line(line), Message::Garbage(_)), "{line}");
        }
    }
}
