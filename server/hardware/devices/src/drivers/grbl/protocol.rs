//! Parser of the lines of GRBL 1.1, grblHAL and FluidNC.
//!
//! Source: `doc/markdown/interface.md` of gnea/grbl (v1.1). The others keep this format and add bracketed lines.

use crate::lines::line_reader::shortened;

/// Soft reset: everything stops, the laser goes off, the banner follows.
pub const RESET: u8 = 0x18;
/// Asks for a status report.
pub const QUERY: u8 = b'?';
/// Feed hold.
pub const HOLD: u8 = b'!';
/// Cycle start: continues after a hold.
pub const RESUME: u8 = b'~';
/// Ends a jog.
pub const JOG_CANCEL: u8 = 0x85;

/// Feed, rapid and spindle as programmed: 100 %.
pub const OVERRIDES_OFF: [u8; 3] = [0x90, 0x95, 0x99];

/// A line from the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// The start-up line, after power-on or reset.
    Banner(String),
    /// The oldest pending line was accepted.
    Ok,
    /// The oldest pending line was refused.
    Error(u32),
    /// An alarm, without a request.
    Alarm(u32),
    /// Answer to [`QUERY`].
    Report(Report),
    /// One line of `$$`.
    Setting {
        /// Its number.
        number: u32,
        /// Its value as sent.
        value: String,
    },
    /// Text in brackets: key and rest, as `VER` and `1.1h.20190825:name`.
    Feedback {
        /// Before the first colon.
        key: String,
        /// After it.
        text: String,
    },
    /// Nothing to act on: an empty line, or the output of a start-up line.
    Nothing,
    /// Not part of the protocol.
    Garbage(String),
}

/// A status report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// State of the machine.
    pub state: MachineState,
    /// Machine or work position of the first axes, mm.
    pub position: Position,
    /// Work coordinate offset of the first axes, mm, if it was sent.
    pub offset_mm: Option<[f64; 3]>,
    /// Programmed spindle speed now effective, which is the laser's power.
    pub spindle: Option<f64>,
    /// Feed, rapid and spindle override, percent, if they were sent.
    pub overrides: Option<[u32; 3]>,
}

/// A position as sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Position {
    /// `MPos`.
    Machine([f64; 3]),
    /// `WPos`; machine position is this plus the work coordinate offset.
    Work([f64; 3]),
}

/// First field of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MachineState {
    /// Ready.
    Idle,
    /// Moving.
    Run,
    /// Jogging.
    Jog,
    /// Braking for a hold.
    Braking,
    /// At rest in a hold.
    Held,
    /// Homing.
    Home,
    /// Locked.
    Alarm,
    /// Stopped by the door switch, at rest.
    Door,
    /// Braking because of the door, parking, or resuming afterwards.
    DoorMoving,
    /// Check mode: parses G-code without moving.
    Check,
    /// Motors switched off.
    Sleep,
    /// Starting.
    Starting,
}

impl MachineState {
    /// Whether anything may move in this state.
    pub fn in_motion(self) -> bool {
        use MachineState::{Braking, DoorMoving, Home, Jog, Run};
        matches!(self, Run | Jog | Braking | Home | DoorMoving)
    }
}

/// Parses one line, without its line ending.
pub fn message_from_line(line: &str) -> Message {
    read(line.trim()).unwrap_or_else(|| Message::Garbage(shortened(line)))
}

fn read(line: &str) -> Option<Message> {
    if line.is_empty() || line.starts_with('>') {
        return Some(Message::Nothing);
    }
    if line == "ok" {
        return Some(Message::Ok);
    }
    if let Some(code) = line.strip_prefix("error:") {
        return code.trim().parse().ok().map(Message::Error);
    }
    if let Some(code) = line.strip_prefix("ALARM:") {
        return code.trim().parse().ok().map(Message::Alarm);
    }
    if let Some(inner) = line.strip_prefix('<') {
        return report_from(inner.strip_suffix('>')?).map(Message::Report);
    }
    if let Some(inner) = line.strip_prefix('[') {
        let inner = inner.strip_suffix(']')?;
        let (key, text) = inner.split_once(':').unwrap_or((inner, ""));
        return Some(Message::Feedback { key: key.to_owned(), text: text.to_owned() });
    }
    if let Some(setting) = line.strip_prefix('$') {
        let (number, value) = setting.split_once('=')?;
        return Some(Message::Setting { number: number.parse().ok()?, value: value.to_owned() });
    }
    // In FluidNC the text after the name can be edited.
    let name = line.split(' ').next().unwrap_or_default();
    let banner = name.eq_ignore_ascii_case("Grbl") || name.eq_ignore_ascii_case("GrblHAL");
    banner.then(|| Message::Banner(line.to_owned()))
}

fn report_from(inner: &str) -> Option<Report> {
    // Two reports whose line ending was lost are not one report.
    if inner.contains(|c: char| matches!(c, '<' | '>') || c.is_control()) {
        return None;
    }
    let mut fields = inner.split('|');
    let state = state_from(fields.next()?)?;
    let (mut position, mut offset_mm, mut spindle, mut overrides) = (None, None, None, None);
    for field in fields {
        let (key, values) = field.split_once(':')?;
        match key {
            "MPos" => position = Some(Position::Machine(axes_from(values)?)),
            "WPos" => position = Some(Position::Work(axes_from(values)?)),
            "WCO" => offset_mm = Some(axes_from(values)?),
            "FS" => spindle = Some(values.split(',').nth(1)?.parse().ok()?),
            "Ov" => overrides = Some(overrides_from(values)?),
            _ => {}
        }
    }
    Some(Report { state, position: position?, offset_mm, spindle, overrides })
}

fn overrides_from(values: &str) -> Option<[u32; 3]> {
    let mut percents = values.split(',').map(|value| value.parse().ok());
    Some([percents.next()??, percents.next()??, percents.next()??])
}

fn state_from(field: &str) -> Option<MachineState> {
    let (word, part) = field.split_once(':').map_or((field, None), |(word, part)| (word, Some(part)));
    Some(match (word, part) {
        ("Idle", _) => MachineState::Idle,
        ("Run", _) => MachineState::Run,
        ("Jog", _) => MachineState::Jog,
        ("Hold", Some("1")) => MachineState::Braking,
        ("Hold", _) => MachineState::Held,
        ("Home", _) => MachineState::Home,
        ("Alarm", _) => MachineState::Alarm,
        ("Door", Some("2" | "3")) => MachineState::DoorMoving,
        ("Door", _) => MachineState::Door,
        // grblHAL waits for a tool change, as in a hold.
        ("Tool", _) => MachineState::Held,
        ("Starting", _) => MachineState::Starting,
        ("Check", _) => MachineState::Check,
        ("Sleep", _) => MachineState::Sleep,
        _ => return None,
    })
}

/// The first three numbers; for a machine with fewer axes the rest are zero.
fn axes_from(values: &str) -> Option<[f64; 3]> {
    let mut axes = [0.0; 3];
    for (axis, value) in axes.iter_mut().zip(values.split(',')) {
        *axis = value.parse().ok().filter(|value: &f64| value.is_finite())?;
    }
    Some(axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines as printed in `interface.md` of gnea/grbl and, where noted, in grblHAL's wiki.
    #[test]
    fn lines_of_the_documentation_are_read() {
        let check = |line: &str, expected: Message| assert_eq!(message_from_line(line), expected, "{line}");
        check("ok", Message::Ok);
        check("error:9", Message::Error(9));
        check("ALARM:3", Message::Alarm(3));
        check("Grbl 1.1h ['$' for help]", Message::Banner("Grbl 1.1h ['$' for help]".into()));
        // grblHAL
        check(
            "GrblHAL 1.1f ['$' or '$HELP' for help]",
            Message::Banner("GrblHAL 1.1f ['$' or '$HELP' for help]".into()),
        );
        // FluidNC
        check(
            "Grbl 4.0 [FluidNC v4.0.1 (esp32-wifi) '$' for help]",
            Message::Banner("Grbl 4.0 [FluidNC v4.0.1 (esp32-wifi) '$' for help]".into()),
        );
        check("$130=200.000", Message::Setting { number: 130, value: "200.000".into() });
        check(
            "[VER:1.1h.20190825:stage 7]",
            Message::Feedback { key: "VER".into(), text: "1.1h.20190825:stage 7".into() },
        );
        check(">G54G20:ok", Message::Nothing);
        check(
            "<Run|WPos:-2.500,0.000,11.000|FS:500,8000|WCO:0.000,1.551,5.664>",
            Message::Report(Report {
                state: MachineState::Run,
                position: Position::Work([-2.5, 0.0, 11.0]),
                offset_mm: Some([0.0, 1.551, 5.664]),
                spindle: Some(8000.0),
                overrides: None,
            }),
        );
    }

    #[test]
    fn a_door_that_brakes_or_parks_is_distinguished_from_one_at_rest() {
        for (field, expected) in [
            ("Door:0", MachineState::Door),
            ("Door:1", MachineState::Door),
            ("Door:2", MachineState::DoorMoving),
            ("Door:3", MachineState::DoorMoving),
            ("Alarm:11", MachineState::Alarm),
            ("Run:2", MachineState::Run),
        ] {
            assert_eq!(state_from(field), Some(expected), "{field}");
        }
    }

    #[test]
    fn what_is_not_the_protocol_is_garbage() {
        for line in [
            "start",
            "<Run|MPos:1.000,0.000,0.000|FS:0,0>\u{b}<Run|MPos:2.000,0.000,0.000|FS:0,0>",
            "<Idle|MPos:0.000",
            "<Flying|MPos:0,0,0>",
            "<Idle|MPos:NaN,0,0>",
            "\u{fffd}\u{3}",
            "okk",
        ] {
            assert!(matches!(message_from_line(line), Message::Garbage(_)), "{line}");
        }
    }
}
