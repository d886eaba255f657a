//! State of a controller and the data to be sent to it: the driver without its thread and its line.
//!
//! Received bytes are passed to [`Session::received`], time to [`Session::tick`], commands to the methods of
//! `commands`; the output collects in `outgoing`. Parts: `opening` (from the reset to the first report), `messages`
//! (messages of a ready controller), `plausibility` (which positions are accepted), `timers`, `commands`.

mod commands;
mod dialogue;
mod messages;
mod opening;
mod plausibility;
mod timers;

use std::collections::VecDeque;
use std::time::Instant;

use super::Dialect;
use super::GrblConfig;
use super::fault::{Device, Fault};
use super::identity::{Description, Machine, stage_from_machine};
use super::protocol::{HOLD, JOG_CANCEL, MachineState, Message, RESET, message_from_line};
use crate::Homing;
use crate::drivers::foreign_lines::ForeignLines;
use crate::drivers::progress::Progress;
use crate::lines::line_reader::shortened;
use crate::params::{GRBL_LINE_BYTES, GRBL_SILENCE};
use opening::Opening;

/// State of the link.
#[derive(Debug)]
enum Link {
    /// Closed; only a reconnection helps.
    Down,
    /// Being opened.
    Opening(Opening),
    /// Ready.
    Up,
}

/// Activity of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Activity {
    Rest,
    Travel(Travel),
    /// Until the acknowledgement of `$H`, which comes at its end: the next report has the position.
    Homing {
        done_at: Option<Instant>,
    },
    Stopping(Stopping),
}

/// A stop: braking, then a soft reset at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stopping {
    /// When the reset is sent although no report showed rest.
    until: Instant,
    /// Whether only a jog was stopped, which ends at rest automatically: no reset.
    only_jog: bool,
    /// Whether its hold was sent after a reset, which does not answer for it: the hold takes effect after the banner.
    after_reset: bool,
    /// Whether a report showed it idle. A report may precede a hold in the same pass, so that two are needed.
    idle_once: bool,
}

/// Path of a move or jog on the machine's scale, mm, and its speed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MotionPath {
    from_mm: f64,
    to_mm: f64,
    speed_mm_s: f64,
    /// When its command was sent.
    since: Instant,
}

/// A move or jog.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Travel {
    target_mm: f64,
    path: MotionPath,
    jog: bool,
    /// When the controller accepted it.
    accepted_at: Option<Instant>,
    last_mm: f64,
    progress: Progress,
}

/// A line sent and not answered yet.
#[derive(Debug)]
struct Pending {
    ticket: u64,
    text: String,
    kind: LineKind,
    sent_at: Instant,
    answer_by: Instant,
}

/// Kind of a pending line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LineKind {
    Build,
    Settings,
    Unlock,
    Home,
    Travel,
    LaserOn,
    LaserOff,
}

/// The last accepted report.
#[derive(Debug, Clone, Copy)]
struct LastReport {
    state: MachineState,
    machine_mm: f64,
    /// When it was requested: no part of it is older.
    queried_at: Instant,
    at: Instant,
    /// When it was received: no part of it is newer.
    received_at: Instant,
}

/// A laser lease.
#[derive(Debug, Clone, Copy)]
struct LaserLease {
    power: f64,
    until: Instant,
}

/// Status queries.
#[derive(Debug, Clone, Copy, Default)]
struct Queries {
    last_sent_at: Option<Instant>,
    /// When the pending query was first sent.
    unanswered_since: Option<Instant>,
}

/// A soft reset sent by this driver.
#[derive(Debug, Clone, Copy)]
struct OwnReset {
    sent_at: Instant,
    /// When its banner is overdue.
    answer_by: Instant,
    /// Whether its banner is still pending.
    awaited: bool,
    /// Whether it raised an alarm, which locks the controller.
    locked: bool,
}

/// See the module.
pub struct Session {
    config: GrblConfig,
    port_name: String,
    link: Link,
    should_be_open: bool,
    fault: Option<Fault>,
    /// Whether the fault was acknowledged and is to be cleared.
    clearing: bool,
    outgoing: Vec<u8>,
    pending: VecDeque<Pending>,
    next_ticket: u64,
    /// The ticket a caller waits for, and how its line was refused.
    waited_for: Option<u64>,
    refusal: Option<Fault>,
    incoming: Vec<u8>,
    incoming_since: Option<Instant>,
    description: Description,
    machine: Option<Machine>,
    offset_mm: [f64; 3],
    offset_known: bool,
    /// An offset that was reported once.
    unconfirmed_offset_mm: Option<[f64; 3]>,
    last_report: Option<LastReport>,
    /// Whether the position at rest was reported twice, or is a move's target.
    is_confirmed: bool,
    /// A position that was reported once and differs from the expected one.
    unconfirmed: Option<LastReport>,
    /// The path of the last move or jog.
    path: Option<MotionPath>,
    /// Since when every report showed rest with the same line pending.
    resting_since: Option<Instant>,
    queries: Queries,
    reset: Option<OwnReset>,
    /// End of the pause after an alarm, in which the firmware does nothing else and may lose a reset.
    quiet_until: Option<Instant>,
    /// After a limit alarm: when a reset is sent again, unless the controller requests one before.
    reset_again_at: Option<Instant>,
    /// Whether only homing unlocks it.
    must_home: bool,
    activity: Activity,
    homed: bool,
    zero_at_machine_mm: f64,
    laser_lease: Option<LaserLease>,
    /// When a soft reset turns the laser off if `M5` did not.
    laser_off_deadline: Option<Instant>,
    stray_reports: usize,
    foreign_lines: ForeignLines,
}

impl Session {
    /// A controller at `port_name`, to be opened.
    pub fn new(config: GrblConfig, port_name: String) -> Self {
        Self {
            zero_at_machine_mm: config.zero_at_machine_mm,
            config,
            port_name,
            link: Link::Down,
            should_be_open: true,
            fault: Some(being_opened()),
            clearing: false,
            outgoing: Vec::new(),
            pending: VecDeque::new(),
            next_ticket: 0,
            waited_for: None,
            refusal: None,
            incoming: Vec::new(),
            incoming_since: None,
            description: Description::default(),
            machine: None,
            offset_mm: [0.0; 3],
            offset_known: false,
            unconfirmed_offset_mm: None,
            last_report: None,
            is_confirmed: false,
            unconfirmed: None,
            path: None,
            resting_since: None,
            queries: Queries::default(),
            reset: None,
            quiet_until: None,
            reset_again_at: None,
            must_home: false,
            activity: Activity::Rest,
            homed: false,
            laser_lease: None,
            laser_off_deadline: None,
            stray_reports: 0,
            foreign_lines: ForeignLines::default(),
        }
    }

    /// Identity and capabilities, once it has been ready.
    pub fn machine(&self) -> Option<&Machine> {
        self.machine.as_ref()
    }

    /// The byte that stops the stage fastest, with those that belong to it ([`stop_bytes`]): a hold keeps the position;
    /// where a hold has no effect (homing, alarm), a soft reset.
    pub fn stop_byte(&self) -> u8 {
        let holdable = !matches!(self.activity, Activity::Homing { .. });
        let locked = self
            .last_report
            .is_none_or(|last_report| matches!(last_report.state, MachineState::Alarm | MachineState::Home));
        // While a reset is pending no other is sent: it would be unknown whether one or two banners follow.
        let up = matches!(self.link, Link::Up) && self.fault.is_none();
        if up && holdable && !locked { HOLD } else { RESET }
    }

    /// Takes bytes received from the line at `now`.
    pub fn received(&mut self, bytes: &[u8], now: Instant) {
        for &byte in bytes {
            if byte == b'\n' {
                let line = String::from_utf8_lossy(&std::mem::take(&mut self.incoming)).into_owned();
                let began_at = self.incoming_since.take().unwrap_or(now);
                self.message(message_from_line(&line), began_at, now);
                continue;
            }
            self.incoming_since.get_or_insert(now);
            self.incoming.push(byte);
            if self.incoming.len() > GRBL_LINE_BYTES {
                self.discard_line(now);
            }
        }
    }

    /// Input without a line ending, or without one in time, is not part of the protocol.
    fn discard_line(&mut self, now: Instant) {
        let text = String::from_utf8_lossy(&std::mem::take(&mut self.incoming)).into_owned();
        self.incoming_since = None;
        self.message(Message::Garbage(shortened(&text)), now, now);
    }

    /// The link is lost because of `fault`: laser and motion are reset if the line still accepts a byte.
    pub fn down(&mut self, fault: Fault) {
        tracing::warn!(port_name = self.port_name, "{}", fault.for_stage());
        self.outgoing.clear();
        // Three times, because the line may lose bytes and there is no answer.
        self.outgoing.extend_from_slice(&[RESET; 3]);
        self.link = Link::Down;
        self.reset_dialogue();
        self.homed = false;
        self.fault = Some(fault);
    }

    /// Clears everything in progress.
    fn reset_dialogue(&mut self) {
        self.pending.clear();
        self.incoming.clear();
        self.incoming_since = None;
        self.queries = Queries::default();
        self.reset = None;
        (self.quiet_until, self.reset_again_at) = (None, None);
        self.activity = Activity::Rest;
        (self.laser_lease, self.laser_off_deadline, self.stray_reports) = (None, None, 0);
        self.foreign_lines = ForeignLines::default();
        self.clearing = false;
    }

    /// A fault over a working link; a reset stops the motion and turns the laser off.
    fn raise(&mut self, fault: Fault, now: Instant) {
        tracing::warn!(port_name = self.port_name, "{}", fault.for_stage());
        self.fault = Some(fault);
        self.activity = Activity::Rest;
        self.soft_reset(now);
    }

    fn soft_reset(&mut self, now: Instant) {
        self.outgoing.push(RESET);
        self.reset_sent(now);
    }

    fn reset_sent(&mut self, now: Instant) {
        let locked = self.reset.is_some_and(|reset| reset.awaited && reset.locked);
        let received_at = self.quiet_until.map_or(now, |until| until.max(now));
        self.reset = Some(OwnReset { sent_at: now, answer_by: received_at + GRBL_SILENCE, awaited: true, locked });
    }

    fn dialect(&self) -> Dialect {
        self.machine.as_ref().map_or_else(|| self.description.dialect(), |machine| machine.dialect)
    }

    /// The fault, if it concerns this device.
    fn fault_of(&self, device: Device) -> Option<&Fault> {
        self.fault.as_ref().filter(|fault| fault.concerns(device))
    }

    fn reset_awaited(&self) -> bool {
        self.reset.is_some_and(|reset| reset.awaited)
    }

    fn position_mm(&self) -> Option<f64> {
        let machine_mm = self.last_report?.machine_mm;
        Some(stage_from_machine(machine_mm, self.zero_at_machine_mm, self.config.reversed))
    }

    fn homing(&self) -> Homing {
        self.machine.as_ref().map_or(Homing::Required, |machine| machine.capabilities.homing)
    }

    fn send_line(&mut self, text: String, kind: LineKind, now: Instant, answer_by: Instant) -> u64 {
        self.outgoing.extend_from_slice(text.as_bytes());
        self.outgoing.push(b'\n');
        self.next_ticket += 1;
        if self.pending.is_empty() {
            self.resting_since = None;
        }
        self.pending.push_back(Pending { ticket: self.next_ticket, text, kind, sent_at: now, answer_by });
        self.next_ticket
    }
}

/// All bytes of a stop. A hold is sent with a jog cancel: grblHAL does not hold jogs, and GRBL ignores the cancel
/// outside of one.
pub fn stop_bytes(byte: u8) -> &'static [u8] {
    if byte == HOLD { &[HOLD, JOG_CANCEL] } else { &[RESET] }
}

fn being_opened() -> Fault {
    Fault::Disconnected { reason: "it is being opened".to_owned() }
}
