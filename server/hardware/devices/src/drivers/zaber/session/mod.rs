//! State of a device and the data to be sent to it: the driver without its thread and its line.
//!
//! Parts: `opening` (from the first stop to the first position), `messages` (messages of a ready device), `timers`,
//! `commands`. Internal positions are the device's microsteps, speeds in the device's units.

mod commands;
mod dialogue;
mod messages;
mod opening;
mod timers;

use std::collections::VecDeque;
use std::time::Instant;

use super::ZaberConfig;
use super::protocol::command;
use crate::drivers::foreign_lines::ForeignLines;
use crate::drivers::progress::Progress;
use crate::lines::line_reader::LineReader;
use crate::{DeviceIdentity, StageCapabilities, StageError};
use opening::Opening;

/// Ids of commands: an answer has that of its command. Stops have the last one.
const N_IDS: u8 = 90;

/// The id of every stop.
const STOP_ID: u8 = 99;

/// State of the link.
#[derive(Debug)]
enum Link {
    Down,
    Opening(Opening),
    Up,
}

/// Activity of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Activity {
    Rest,
    Travel(Travel),
    /// When the device accepted the command.
    Homing {
        begun_at: Instant,
        accepted_at: Option<Instant>,
    },
    /// Braking, by when it must be at rest, and the motion continued by [`crate::Stage::resume`].
    Stopping {
        sent_at: Instant,
        then: Option<Travel>,
    },
    /// Held at rest.
    Held(Travel),
}

/// A move or jog.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Travel {
    target_mm: f64,
    target_steps: i64,
    speed_data: i64,
    accepted_at: Option<Instant>,
    last_steps: i64,
    progress: Progress,
}

/// Kind of a pending command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CommandKind {
    Opening,
    Position,
    Serial,
    Move,
    Home,
    Stop,
    Clear,
}

/// A command sent and not answered yet.
#[derive(Debug)]
struct Pending {
    ticket: u64,
    id: u8,
    what: CommandKind,
    text: String,
    sent_at: Instant,
}

/// The last answer with a position.
#[derive(Debug, Clone)]
struct LastReport {
    steps: i64,
    busy: bool,
    at: Instant,
}

/// The device's description of itself.
#[derive(Debug, Clone)]
pub struct Machine {
    pub identity: DeviceIdentity,
    pub capabilities: StageCapabilities,
    serial: String,
    /// Microsteps per millimetre.
    steps_per_mm: f64,
}

/// See the module.
pub struct Session {
    config: ZaberConfig,
    port_name: String,
    link: Link,
    should_be_open: bool,
    fault: Option<StageError>,
    clearing: bool,
    outgoing: Vec<u8>,
    pending: VecDeque<Pending>,
    next_ticket: u64,
    next_id: u8,
    waited_for: Option<u64>,
    refusal: Option<StageError>,
    reader: LineReader,
    /// A line to be continued, with its text so far.
    partial: Option<super::protocol::Message>,
    machine: Option<Machine>,
    seen: Option<LastReport>,
    received_at: Option<Instant>,
    position_queried_at: Option<Instant>,
    serial_queried_at: Option<Instant>,
    foreign_lines: ForeignLines,
    activity: Activity,
    /// Whether the last position came without a reference.
    last_flag_unreferenced: bool,
    homed: bool,
}

impl Session {
    /// A device at `port_name`, to be opened.
    pub fn new(config: ZaberConfig, port_name: String) -> Self {
        Self {
            config,
            port_name,
            link: Link::Down,
            should_be_open: true,
            fault: Some(being_opened()),
            clearing: false,
            outgoing: Vec::new(),
            pending: VecDeque::new(),
            next_ticket: 0,
            next_id: 0,
            waited_for: None,
            refusal: None,
            reader: LineReader::default(),
            partial: None,
            machine: None,
            seen: None,
            received_at: None,
            position_queried_at: None,
            serial_queried_at: None,
            foreign_lines: ForeignLines::default(),
            activity: Activity::Rest,
            last_flag_unreferenced: false,
            homed: false,
        }
    }

    /// Identity and capabilities, once it has been ready.
    pub fn machine(&self) -> Option<&Machine> {
        self.machine.as_ref()
    }

    /// The link is lost; motion is stopped if the line still accepts bytes.
    fn down(&mut self, fault: StageError) {
        tracing::warn!(port_name = self.port_name, "{fault}");
        self.outgoing = self.stop_line();
        self.link = Link::Down;
        self.reset_dialogue();
        self.homed = false;
        self.fault = Some(fault);
    }

    fn reset_dialogue(&mut self) {
        self.pending.clear();
        self.reader.clear();
        self.partial = None;
        (self.received_at, self.position_queried_at, self.serial_queried_at) = (None, None, None);
        self.foreign_lines = ForeignLines::default();
        self.activity = Activity::Rest;
        self.clearing = false;
    }

    /// A fault over a working link: motion is stopped, and no position is trusted.
    fn raise(&mut self, fault: StageError, now: Instant) {
        if self.fault.is_some() {
            return;
        }
        tracing::warn!(port_name = self.port_name, "{fault}");
        if self.activity != Activity::Rest {
            self.send_stop(now);
        }
        (self.activity, self.homed) = (Activity::Rest, false);
        self.fault = Some(fault);
    }

    fn position_mm(&self) -> Option<f64> {
        Some(self.mm_from_steps(self.seen.as_ref()?.steps))
    }

    fn mm_from_steps(&self, steps: i64) -> f64 {
        let device_mm = steps as f64 / self.steps_per_mm();
        let from_zero_mm = device_mm - self.config.zero_at_device_mm;
        if self.config.reversed { -from_zero_mm } else { from_zero_mm }
    }

    fn steps_from_mm(&self, position_mm: f64) -> i64 {
        let from_zero_mm = if self.config.reversed { -position_mm } else { position_mm };
        ((from_zero_mm + self.config.zero_at_device_mm) * self.steps_per_mm()).round() as i64
    }

    fn steps_per_mm(&self) -> f64 {
        self.machine.as_ref().map_or(1.0, |machine| machine.steps_per_mm)
    }

    /// Sends a command to the axis (`scope` 0: to the device); returns the ticket of the answer.
    fn send(&mut self, scope: u8, text: &str, what: CommandKind, now: Instant) -> u64 {
        self.next_id = (self.next_id + 1) % N_IDS;
        let id = if what == CommandKind::Stop { STOP_ID } else { self.next_id };
        let line = command(self.config.address, scope, id, text);
        self.outgoing.extend_from_slice(line.as_bytes());
        self.next_ticket += 1;
        let ticket = self.next_ticket;
        self.pending.retain(|pending| pending.id != id);
        self.pending.push_back(Pending { ticket, id, what, text: text.to_owned(), sent_at: now });
        ticket
    }

    fn send_stop(&mut self, now: Instant) -> u64 {
        self.send(self.config.axis, "stop", CommandKind::Stop, now)
    }

    /// A stop on a line of its own: a partial line that may precede it is ended first, and is then invalid.
    fn stop_line(&self) -> Vec<u8> {
        format!("\n{}", command(self.config.address, self.config.axis, STOP_ID, "stop")).into_bytes()
    }
}

fn being_opened() -> StageError {
    StageError::Disconnected { reason: "it is being opened".to_owned() }
}
