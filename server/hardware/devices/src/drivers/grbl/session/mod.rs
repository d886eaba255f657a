//! What is known of a controller and what is to be sent to it: the driver without its thread and its line.
//!
//! Bytes come in by [`Session::received`], time by [`Session::tick`], wishes by the methods of `commands`; what is
//! to be written collects in `outgoing`. Parts: `opening` (from the reset to the first report), `messages` (what
//! comes when it is up), `belief` (which positions are accepted), `timers`, `commands`.

mod belief;
mod commands;
mod dialogue;
mod messages;
mod opening;
mod timers;

use std::collections::VecDeque;
use std::time::Instant;

use super::Dialect;
use super::GrblConfig;
use super::fault::{Device, Fault};
use super::identity::{Description, Machine, stage_from_machine};
use super::protocol::{HOLD, JOG_CANCEL, MachineState, RESET, message_from_line};
use crate::Homing;
use crate::params::{GRBL_LINE_BYTES, GRBL_SILENCE};
use opening::Opening;

/// How far the link is.
#[derive(Debug)]
enum Link {
    /// Not open; only a reconnection helps.
    Down,
    /// Being opened.
    Opening(Opening),
    /// In dialogue.
    Up,
}

/// What the stage does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Activity {
    Rest,
    Travel(Travel),
    /// Since the acknowledgement of `$H`, which comes at its end: the next report has the position.
    Homing {
        done_at: Option<Instant>,
    },
    Stopping(Stopping),
}

/// A stop: it brakes, and at rest a soft reset makes it final.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stopping {
    /// When the reset comes though no report showed rest.
    until: Instant,
    /// Whether there was nothing but a jog, which is over when it rests: no reset.
    only_jog: bool,
    /// Whether its hold went out behind a reset, which does not answer for it: it holds after the banner.
    behind_reset: bool,
    /// Whether a report showed it idle. A report may come before a hold in the same pass, so that it takes two.
    idle_once: bool,
}

/// Where a move or jog goes by the machine's scale, mm, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Way {
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
    way: Way,
    jog: bool,
    /// When the controller took it.
    taken_at: Option<Instant>,
    /// Where it was when it last came on, and when.
    last_mm: f64,
    last_progress_at: Instant,
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

/// What an answer means.
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

/// The last report.
#[derive(Debug, Clone, Copy)]
struct Seen {
    state: MachineState,
    machine_mm: f64,
    /// When it was asked for: no part of it is older.
    asked_at: Instant,
    at: Instant,
    /// When it came: no part of it is newer.
    heard_at: Instant,
}

/// Light as it was leased.
#[derive(Debug, Clone, Copy)]
struct Lit {
    power: f64,
    until: Instant,
}

/// Status queries.
#[derive(Debug, Clone, Copy, Default)]
struct Queries {
    last_sent_at: Option<Instant>,
    /// When the query now under way was sent first.
    unanswered_since: Option<Instant>,
}

/// A soft reset of our own.
#[derive(Debug, Clone, Copy)]
struct OwnReset {
    sent_at: Instant,
    /// When its banner is missed.
    answer_by: Instant,
    /// Whether its banner is still to come.
    awaited: bool,
    /// Whether it raised an alarm, which locks the controller.
    locked: bool,
}

/// See the module.
pub struct Session {
    config: GrblConfig,
    place: String,
    link: Link,
    wants_open: bool,
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
    doubted_offset_mm: Option<[f64; 3]>,
    seen: Option<Seen>,
    /// Whether the position at rest was reported twice, or is where a move was to end.
    is_confirmed: bool,
    /// A position that was reported once and is not where it was to be.
    doubted: Option<Seen>,
    /// The way of the last move or jog.
    way: Option<Way>,
    /// Since when every report was of rest, with the same line waiting for its answer.
    resting_since: Option<Instant>,
    queries: Queries,
    reset: Option<OwnReset>,
    /// After an alarm: until then the firmware does nothing else, and may lose a reset.
    quiet_until: Option<Instant>,
    /// After a limit alarm: when a reset is sent again, unless it asks for one before.
    reset_again_at: Option<Instant>,
    /// Whether only homing unlocks it.
    must_home: bool,
    activity: Activity,
    homed: bool,
    zero_at_machine_mm: f64,
    lit: Option<Lit>,
    /// When a soft reset turns off what `M5` did not.
    dark_by: Option<Instant>,
    stray_reports: usize,
    garbage_at: VecDeque<Instant>,
}

impl Session {
    /// A controller at `place`, to be opened.
    pub fn new(config: GrblConfig, place: String) -> Self {
        Self {
            zero_at_machine_mm: config.zero_at_machine_mm,
            config,
            place,
            link: Link::Down,
            wants_open: true,
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
            doubted_offset_mm: None,
            seen: None,
            is_confirmed: false,
            doubted: None,
            way: None,
            resting_since: None,
            queries: Queries::default(),
            reset: None,
            quiet_until: None,
            reset_again_at: None,
            must_home: false,
            activity: Activity::Rest,
            homed: false,
            lit: None,
            dark_by: None,
            stray_reports: 0,
            garbage_at: VecDeque::new(),
        }
    }

    /// Who it is and what it can do, once it was up.
    pub fn machine(&self) -> Option<&Machine> {
        self.machine.as_ref()
    }

    /// The byte that stops the stage soonest, with what belongs to it ([`stop_bytes`]): a hold keeps the position;
    /// where a hold has no effect (homing, alarm), a soft reset.
    pub fn stop_byte(&self) -> u8 {
        let holdable = !matches!(self.activity, Activity::Homing { .. });
        let locked = self.seen.is_none_or(|seen| matches!(seen.state, MachineState::Alarm | MachineState::Home));
        // While a reset is awaited another is not sent: whether one banner or two would follow cannot be known.
        let up = matches!(self.link, Link::Up) && self.fault.is_none();
        if up && holdable && !locked { HOLD } else { RESET }
    }

    /// Takes what came from the line at `now`.
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
                self.give_up_line(now);
            }
        }
    }

    /// What came without an end, or without one in time, is none of the protocol's lines.
    fn give_up_line(&mut self, now: Instant) {
        let text = String::from_utf8_lossy(&std::mem::take(&mut self.incoming)).into_owned();
        self.incoming_since = None;
        self.garbage(super::protocol::shortened(&text), now);
    }

    /// The link is lost for `fault`: whatever shone or moved is reset if the line still takes a byte.
    pub fn down(&mut self, fault: Fault) {
        tracing::warn!(place = self.place, "{}", fault.for_stage());
        self.outgoing.clear();
        // Three times: it is the last word where a line loses bytes, and nothing answers for it.
        self.outgoing.extend_from_slice(&[RESET; 3]);
        self.link = Link::Down;
        self.forget_dialogue();
        self.homed = false;
        self.fault = Some(fault);
    }

    /// Nothing that was under way is under way any more.
    fn forget_dialogue(&mut self) {
        self.pending.clear();
        self.incoming.clear();
        self.incoming_since = None;
        self.queries = Queries::default();
        self.reset = None;
        (self.quiet_until, self.reset_again_at) = (None, None);
        self.activity = Activity::Rest;
        (self.lit, self.dark_by, self.stray_reports) = (None, None, 0);
        self.garbage_at.clear();
        self.clearing = false;
    }

    /// A fault over a sound link; a reset stops the motion and turns the laser off.
    fn raise(&mut self, fault: Fault, now: Instant) {
        tracing::warn!(place = self.place, "{}", fault.for_stage());
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
        let heard_at = self.quiet_until.map_or(now, |until| until.max(now));
        self.reset = Some(OwnReset { sent_at: now, answer_by: heard_at + GRBL_SILENCE, awaited: true, locked });
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
        let machine_mm = self.seen?.machine_mm;
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

/// All that goes out with a stop's byte. A hold comes with a jog's cancellation: grblHAL does not hold jogs, and GRBL
/// ignores the cancellation outside of one.
pub fn stop_bytes(byte: u8) -> &'static [u8] {
    if byte == HOLD { &[HOLD, JOG_CANCEL] } else { &[RESET] }
}

fn being_opened() -> Fault {
    Fault::Gone { reason: "it is being opened".to_owned() }
}
