//! State of a controller and the data to be sent to it: the driver without its thread and its line.
//!
//! One line is pending at a time: the next is selected when it is acknowledged, so that a requested resend concerns the
//! last line, and it is always known what was sent. Parts: `opening`, `messages` (messages of a ready controller),
//! `lines` (selection of the next line), `timers`, `commands`. Internal positions are the machine's steps.

mod commands;
mod dialogue;
mod lines;
mod messages;
mod opening;
mod timers;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::MarlinConfig;
use crate::drivers::foreign_lines::ForeignLines;
use crate::drivers::progress::Progress;
use crate::lines::line_reader::LineReader;
use crate::params::{MARLIN_AHEAD, MARLIN_STOP_SLACK};
use crate::{DeviceIdentity, LaserError, StageCapabilities, StageError};
use opening::Opening;

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
    Homing { begun_at: Instant, done_at: Option<Instant> },
    Stopping(Stopping),
    Held(Travel),
}

/// A move or jog, sent piece by piece.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Travel {
    target_mm: f64,
    target_steps: i64,
    speed_mm_s: f64,
    /// End of the last piece sent.
    sent_steps: i64,
    last_steps: i64,
    progress: Progress,
    /// When the firmware reported that everything was executed.
    settled_at: Option<Instant>,
}

/// No more pieces are sent; those sent run out.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stopping {
    until: Instant,
    settled_at: Option<Instant>,
    /// The motion continued by [`crate::Stage::resume`].
    then: Option<Travel>,
    /// Whether it was cut short by a quick stop, at the cost of the position.
    is_quick_stop: bool,
}

/// Kind of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LineKind {
    Query,
    Setting,
    Position,
    Piece,
    Settle,
    Home,
    LaserOn,
    LaserOff,
    LightKeepalive,
}

/// A queued line.
#[derive(Debug, Clone, PartialEq)]
struct QueuedLine {
    ticket: u64,
    text: String,
    kind: LineKind,
}

/// The line sent and not acknowledged yet.
#[derive(Debug)]
struct Pending {
    queued: QueuedLine,
    number: u32,
    sent_at: Instant,
    answer_by: Instant,
    /// When it is resent on request.
    resend_at: Option<Instant>,
    n_resends: u32,
    unknown: bool,
}

#[derive(Debug, Clone, Copy)]
struct LastReport {
    steps: i64,
    at: Instant,
}

#[derive(Debug, Clone, Copy)]
struct LaserLease {
    power: f64,
    until: Instant,
}

/// The controller's description of itself.
#[derive(Debug, Clone)]
pub struct Machine {
    pub identity: DeviceIdentity,
    pub capabilities: StageCapabilities,
}

/// The device whose command was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Device {
    Stage,
    Laser,
}

/// See the module.
pub struct Session {
    config: MarlinConfig,
    port_name: String,
    link: Link,
    should_be_open: bool,
    fault: Option<(StageError, Device)>,
    outgoing: Vec<u8>,
    queued: VecDeque<QueuedLine>,
    pending: Option<Pending>,
    next_ticket: u64,
    last_number: u32,
    waited_for: Option<u64>,
    refusal: Option<StageError>,
    reader: LineReader,
    received_at: Option<Instant>,
    machine: Option<Machine>,
    last_report: Option<LastReport>,
    position_queried_at: Option<Instant>,
    foreign_lines: ForeignLines,
    activity: Activity,
    homed: bool,
    laser_lease: Option<LaserLease>,
    /// When `M112` turns the laser off if `M5` did not.
    laser_off_deadline: Option<Instant>,
    light_kept_at: Option<Instant>,
}

impl Session {
    /// A controller at `port_name`, to be opened.
    pub fn new(config: MarlinConfig, port_name: String) -> Self {
        Self {
            config,
            port_name,
            link: Link::Down,
            should_be_open: true,
            fault: Some((being_opened(), Device::Stage)),
            outgoing: Vec::new(),
            queued: VecDeque::new(),
            pending: None,
            next_ticket: 0,
            last_number: 0,
            waited_for: None,
            refusal: None,
            reader: LineReader::default(),
            received_at: None,
            machine: None,
            last_report: None,
            position_queried_at: None,
            foreign_lines: ForeignLines::default(),
            activity: Activity::Rest,
            homed: false,
            laser_lease: None,
            laser_off_deadline: None,
            light_kept_at: None,
        }
    }

    /// Identity and capabilities, once it has been ready.
    pub fn machine(&self) -> Option<&Machine> {
        self.machine.as_ref()
    }

    /// The link is lost. A laser that may be on, and homing, are halted permanently if the line still accepts it;
    /// pieces of a move run out.
    fn down(&mut self, fault: StageError) {
        tracing::warn!(port_name = self.port_name, "{fault}");
        let must_halt = self.laser_lease.is_some() || matches!(self.activity, Activity::Homing { .. });
        self.outgoing = if must_halt { HALT.to_vec() } else { Vec::new() };
        self.link = Link::Down;
        self.reset_dialogue();
        self.homed = false;
        self.fault = Some((fault, Device::Stage));
    }

    fn reset_dialogue(&mut self) {
        self.queued.clear();
        self.pending = None;
        self.reader.clear();
        (self.received_at, self.position_queried_at, self.last_report) = (None, None, None);
        self.foreign_lines = ForeignLines::default();
        self.activity = Activity::Rest;
        (self.laser_lease, self.laser_off_deadline, self.light_kept_at) = (None, None, None);
    }

    /// A fault over a working link: pieces run out, the laser goes off, and no position is trusted.
    fn raise(&mut self, fault: StageError, now: Instant) {
        if self.fault.is_some() {
            return;
        }
        tracing::warn!(port_name = self.port_name, "{fault}");
        self.begin_stop(None, now);
        self.turn_laser_off(now);
        self.homed = false;
        self.fault = Some((fault, Device::Stage));
    }

    /// Halts the controller by `M112`: motors and laser are off, and only its reset button helps.
    fn halt(&mut self, why: &str) {
        self.laser_lease = None;
        self.down(halted(why));
        self.outgoing = HALT.to_vec();
    }

    fn fault_of(&self, device: Device) -> Option<&StageError> {
        let concerns =
            |by: Device, fault: &StageError| by == device || !matches!(fault, StageError::Rejected { .. });
        self.fault.as_ref().filter(|(fault, by)| concerns(*by, fault)).map(|(fault, _)| fault)
    }

    fn position_mm(&self) -> Option<f64> {
        Some(self.mm_from_steps(self.last_report?.steps))
    }

    fn mm_from_steps(&self, steps: i64) -> f64 {
        let from_zero_mm = steps as f64 / self.config.steps_per_mm - self.config.zero_at_machine_mm;
        if self.config.reversed { -from_zero_mm } else { from_zero_mm }
    }

    fn steps_from_mm(&self, position_mm: f64) -> i64 {
        let from_zero_mm = if self.config.reversed { -position_mm } else { position_mm };
        ((from_zero_mm + self.config.zero_at_machine_mm) * self.config.steps_per_mm).round() as i64
    }

    fn acceleration_mm_s2(&self) -> f64 {
        self.machine.as_ref().and_then(|machine| machine.capabilities.acceleration_mm_s2).unwrap_or(100.0).max(1.0)
    }

    /// Look-ahead of the pieces over the motor, mm: the braking distance, and [`MARLIN_AHEAD`].
    fn ahead_mm(&self, speed_mm_s: f64) -> f64 {
        speed_mm_s * MARLIN_AHEAD.as_secs_f64() + 1.3 * speed_mm_s * speed_mm_s / (2.0 * self.acceleration_mm_s2())
    }

    /// Longest time until nothing moves after the last piece was sent.
    fn run_out(&self, speed_mm_s: f64) -> Duration {
        let ramp_s = 1.5 * speed_mm_s / self.acceleration_mm_s2();
        MARLIN_AHEAD + Duration::from_secs_f64(ramp_s.min(5.0)) + MARLIN_STOP_SLACK
    }
}

/// `M112` on a line of its own: a partial line that may precede it is ended first. It is sent three times, because the
/// line may lose bytes and there is no answer.
const HALT: &[u8] = b"\nM112\nM112\nM112\n";

fn being_opened() -> StageError {
    StageError::Disconnected { reason: "it is being opened".to_owned() }
}

fn halted(why: &str) -> StageError {
    StageError::Disconnected { reason: format!("{why}; press its reset button") }
}

/// Converts a fault of the line to the laser's error.
fn for_laser(fault: &StageError) -> LaserError {
    match fault {
        StageError::Rejected { .. } | StageError::Stalled { .. } | StageError::Warned { .. } => {
            LaserError::Controller(fault.clone())
        }
        _ => LaserError::Disconnected { reason: fault.to_string() },
    }
}
