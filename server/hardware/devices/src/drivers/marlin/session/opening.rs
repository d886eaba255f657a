//! From the first line to the first position: the motion and laser left on by a terminated program are stopped,
//! identity and settings are read.

use std::time::Instant;

use super::{Activity, LastReport, LineKind, Link, Machine, Session, being_opened};
use crate::drivers::marlin::protocol::Message;
use crate::params::{MARLIN_KEEPALIVE_S, MARLIN_OPENING_PERIOD, MARLIN_QUIET, MARLIN_SILENCE};
use crate::{DeviceIdentity, Homing, StageCapabilities, StageError};

/// Sent first, and repeated until there is an answer: drops moves, turns the laser off, restarts line numbers, queries
/// the identity.
/// `M410` reaches the emergency parser at once; the others wait until it has taken effect.
const FIRST_LINES: &[u8] = b"\nM410\nM5\nN0 M110 N0*125\nM115\n";

/// Progress of an opening.
#[derive(Debug)]
pub struct Opening {
    since: Instant,
    step: Step,
    contacted_at: Instant,
    /// The first line that is not Marlin's.
    foreign: Option<(Instant, String)>,
    description: Description,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// Until it has stated its identity.
    Contacting,
    /// Until nothing more is received: late answers must not be taken for those of the numbered dialogue.
    Draining,
    /// The numbered queries.
    Querying,
}

/// The controller's description of itself.
#[derive(Debug, Default)]
struct Description {
    firmware: Option<String>,
    emergency_parser: bool,
    lines: Vec<String>,
}

impl Session {
    pub(super) fn begin_opening(&mut self, now: Instant) {
        self.should_be_open = false;
        self.reset_dialogue();
        self.homed = false;
        self.fault = Some((being_opened(), super::Device::Stage));
        self.outgoing = FIRST_LINES.to_vec();
        self.link = Link::Opening(Opening {
            since: now,
            step: Step::Contacting,
            contacted_at: now,
            foreign: None,
            description: Description::default(),
        });
    }

    pub(super) fn opening_message(&mut self, message: Message, began_at: Instant, now: Instant) {
        let Link::Opening(opening) = &mut self.link else { return };
        match message {
            Message::Start => {
                // It restarted with its port: earlier queries are lost.
                (opening.step, opening.foreign) = (Step::Contacting, None);
                opening.description = Description::default();
                opening.contacted_at = now - MARLIN_OPENING_PERIOD + 2 * MARLIN_QUIET;
                self.pending = None;
                self.queued.clear();
            }
            Message::Text(text) => {
                if let Some(firmware) = text.strip_prefix("FIRMWARE_NAME:") {
                    opening.description.firmware = Some(firmware.to_owned());
                    opening.foreign = None;
                    if opening.step == Step::Contacting {
                        opening.step = Step::Draining;
                    }
                }
                opening.description.lines.push(text);
            }
            Message::Capability(name, has) if name == "EMERGENCY_PARSER" => {
                opening.description.emergency_parser = has;
            }
            Message::Halted(text) => self.down(super::halted(&format!("it is halted ({})", text.trim()))),
            Message::Garbage(text) => {
                opening.foreign.get_or_insert((now, text));
            }
            Message::Resend(number) if opening.step == Step::Querying => self.resend(number, now),
            Message::Ok(_) if opening.step == Step::Querying => {
                let again = self.pending.as_ref().is_some_and(|pending| pending.resend_at.is_some());
                if !again && self.pending.take().is_some_and(|pending| pending.queued.kind == LineKind::Position) {
                    self.reached(now);
                }
            }
            Message::Position(position) if opening.step == Step::Querying => {
                let steps = position.steps[self.config.axis.idx()];
                self.last_report = Some(LastReport { steps, at: began_at });
            }
            Message::Busy
            | Message::Ok(_)
            | Message::Resend(_)
            | Message::Position(_)
            | Message::Error(_)
            | Message::EndstopHit(_)
            | Message::Unknown(_)
            | Message::Capability(..) => {}
        }
    }

    pub(super) fn opening_tick(&mut self, now: Instant) {
        self.resend_if_requested(now);
        let Link::Opening(opening) = &mut self.link else { return };
        let waited = now - opening.since;
        let foreign =
            opening.foreign.take_if(|(at, _)| now - *at > MARLIN_SILENCE && opening.step == Step::Contacting);
        if let Some((_, text)) = foreign {
            let (port_name, expected) = (self.port_name.clone(), "Marlin".to_owned());
            return self.down(StageError::WrongDevice { port_name, expected, found: format!("`{text}`") });
        }
        if waited > self.config.open_limit {
            let command = self.pending.as_ref().map_or("M115", |pending| pending.queued.text.as_str()).to_owned();
            return self.down(StageError::NoResponse { command, waited_ms: waited.as_millis() as u64 });
        }
        match opening.step {
            Step::Contacting if now - opening.contacted_at > MARLIN_OPENING_PERIOD => {
                opening.contacted_at = now;
                self.outgoing.extend_from_slice(FIRST_LINES);
            }
            Step::Draining if self.received_at.is_some_and(|at| now - at > MARLIN_QUIET) => {
                opening.step = Step::Querying;
                self.last_number = 0;
                self.queue_opening_queries();
            }
            _ => {}
        }
    }

    fn resend_if_requested(&mut self, now: Instant) {
        let again = self.pending.as_mut().filter(|pending| pending.resend_at.is_some_and(|at| now >= at));
        if let Some(pending) = again {
            pending.resend_at = None;
            let line = crate::drivers::marlin::protocol::numbered(pending.number, &pending.queued.text);
            self.outgoing.extend_from_slice(line.as_bytes());
        }
    }

    /// A previous owner of the port left line numbers behind: they are restarted. Millimetres and absolute positions; a
    /// busy message every second during long lines; motors that stay on, because the position would be lost otherwise.
    fn queue_opening_queries(&mut self) {
        let keepalive = format!("M113 S{MARLIN_KEEPALIVE_S}");
        let settings = ["M110 N1", "G21", "G90", &keepalive, "M84 S0", "M17"];
        for text in settings {
            self.enqueue(text.to_owned(), LineKind::Setting);
        }
        for text in ["M503", "M211"] {
            self.enqueue(text.to_owned(), LineKind::Query);
        }
        self.enqueue("M114".to_owned(), LineKind::Position);
    }

    fn reached(&mut self, now: Instant) {
        let Link::Opening(opening) = &self.link else { return };
        match opening.description.machine(&self.config, &self.port_name) {
            Ok(machine) => {
                self.machine = Some(machine);
                (self.link, self.fault, self.activity) = (Link::Up, None, Activity::Rest);
                self.position_queried_at = Some(now);
            }
            Err(fault) => self.down(fault),
        }
    }
}

impl Description {
    /// Checks identity, emergency parser, steps and travel; returns the settings used by the driver.
    fn machine(&self, config: &super::MarlinConfig, port_name: &str) -> Result<Machine, StageError> {
        let wrong = |expected: &str, found: String| {
            Err(StageError::WrongDevice { port_name: port_name.to_owned(), expected: expected.to_owned(), found })
        };
        let firmware = self.firmware.clone().unwrap_or_default();
        if let Some(expected) = config.expected_name.as_ref().filter(|name| !firmware.contains(name.as_str())) {
            return wrong(&format!("a controller named `{expected}`"), format!("one that reports `{firmware}`"));
        }
        if !self.emergency_parser {
            return wrong(
                "a controller that accepts M112 at any time (Cap:EMERGENCY_PARSER:1)",
                "none: build Marlin with EMERGENCY_PARSER, without which homing cannot be stopped".to_owned(),
            );
        }
        let letter = config.axis.letter();
        let of = |command: &str| self.setting(command, letter);
        let steps_per_mm = of("M92").unwrap_or(0.0);
        // Printed with two decimals.
        if (steps_per_mm - config.steps_per_mm).abs() > 0.006 {
            return wrong(&format!("{} steps/mm (M92 {letter})", config.steps_per_mm), steps_per_mm.to_string());
        }
        if let Some(offset_mm) = of("M206").filter(|offset| *offset != 0.0) {
            return wrong("no home offset (M206)", format!("{offset_mm} mm: send M206 {letter}0"));
        }
        if let Some((low_mm, high_mm)) = self.soft_endstops(letter) {
            for end_mm in [config.travel_mm.0, config.travel_mm.1] {
                let from_zero_mm = if config.reversed { -end_mm } else { end_mm };
                let machine_mm = from_zero_mm + config.zero_at_machine_mm;
                if machine_mm < low_mm || machine_mm > high_mm {
                    let expected = format!("a machine that reaches {machine_mm} mm (stage position {end_mm} mm)");
                    return wrong(&expected, format!("one of {low_mm} to {high_mm} mm (M211)"));
                }
            }
        }
        let acceleration_mm_s2 = match (of("M201"), self.setting("M204", 'T')) {
            (Some(axis), Some(travel)) => Some(axis.min(travel)),
            (axis, travel) => axis.or(travel),
        };
        let fastest_mm_s = of("M203").unwrap_or(f64::INFINITY).min(config.max_speed_mm_s);
        let (name, rest) = firmware.split_once(" SOURCE_CODE_URL").unwrap_or((&firmware, ""));
        let field = |key: &str| {
            let text = rest.split(key).nth(1)?.trim_start_matches(':');
            Some(text.split(" EXTRUDER_COUNT").next()?.split(" UUID").next()?.trim().to_owned())
        };
        Ok(Machine {
            identity: DeviceIdentity {
                driver: "marlin",
                vendor: String::new(),
                model: field("MACHINE_TYPE").unwrap_or_default(),
                serial: field("UUID").unwrap_or_default(),
                firmware: name.split(" (").next().unwrap_or(name).to_owned(),
            },
            capabilities: StageCapabilities {
                kind: config.kind,
                travel_mm: config.travel_mm,
                max_speed_mm_s: fastest_mm_s,
                acceleration_mm_s2,
                homing: Homing::Required,
                resolution_mm: 1.0 / config.steps_per_mm,
                follows_frames: false,
                frame_pitch_mm: None,
            },
        })
    }

    /// The number after `letter` in the last line that begins with `command`.
    fn setting(&self, command: &str, letter: char) -> Option<f64> {
        let mut lines = self.lines.iter().rev().map(|line| line.split_whitespace());
        lines.find_map(|mut words| {
            (words.next() == Some(command))
                .then(|| words.find_map(|word| word.strip_prefix(letter)?.parse().ok()))?
        })
    }

    /// Lowest and highest position of `M211`, if stated.
    fn soft_endstops(&self, letter: char) -> Option<(f64, f64)> {
        let of = |key: &str| {
            let line = self.lines.iter().rev().find(|line| line.contains(key))?;
            let words = line.split(key).nth(1)?.split_whitespace();
            words.into_iter().find_map(|word| word.strip_prefix(letter)?.parse::<f64>().ok())
        };
        Some((of("Min:")?, of("Max:")?))
    }
}
