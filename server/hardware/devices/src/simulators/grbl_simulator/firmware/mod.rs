//! The firmware's side of the dialogue, with its own texts and order, for three dialects.
//!
//! `realtime` takes single bytes, `alarms` resets and alarms with their pauses, `lines` executes text lines,
//! `texts` formats identity and settings. The sources are listed in [`super::dialect`].
//! Simplified: one axis, every planned move from rest to rest, no overrides, no parking.

mod alarms;
mod lines;
mod realtime;
mod texts;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::dialect::Dialect;
use super::motion::Motion;
use super::{Event, SimulatorConfig};
use crate::simulators::simulator::{EventLog, Firmware as SimulatedFirmware, LogEvent};
use alarms::Pause;

/// Time to resume after the door was closed.
const DOOR_RESTORE: Duration = Duration::from_millis(50);

/// State of the machine; `Hold` and `Door` brake while there is a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum State {
    Idle,
    Run,
    Jog,
    Hold,
    Home,
    Alarm,
    /// After a limit alarm: only a reset helps.
    Critical,
    Door,
    Check,
    Sleep,
}

/// A planned move.
#[derive(Debug, Clone, Copy)]
struct Planned {
    target_mm: f64,
    speed_mm_s: f64,
}

/// Modal words.
#[derive(Debug, Clone, Copy)]
struct Modal {
    feeds: bool,
    absolute: bool,
    feed_mm_min: f64,
    spindle: Spindle,
    speed: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Spindle {
    Off,
    Constant,
    Dynamic,
}

const START_MODAL: Modal =
    Modal { feeds: false, absolute: true, feed_mm_min: 0.0, spindle: Spindle::Off, speed: 0.0 };

/// A controller with its machine.
pub struct Firmware {
    config: SimulatorConfig,
    event_log: EventLog,
    state: State,
    modal: Modal,
    at_mm: f64,
    motion: Option<Motion>,
    /// The first is in progress or held.
    planned: VecDeque<Planned>,
    /// A jog is braking, followed by this state.
    after_jog: Option<State>,
    /// The rest of homing: the pull-off.
    homing_legs: VecDeque<f64>,
    /// Received bytes, not read yet.
    rx: Vec<u8>,
    /// When the line being executed is answered.
    reply_at: Option<(Instant, &'static str)>,
    pause: Option<Pause>,
    query: bool,
    lit: Option<f64>,
    /// Feed, rapid and spindle override, percent.
    overrides: [u32; 3],
    /// Whether the next report states them.
    reports_overrides: bool,
    reports: usize,
    report_mask: u32,
    /// The firmware's own state: whether its axis is homed, and whether it requires homing.
    homed: bool,
    must_home: bool,
    door_open: bool,
    restored_at: Option<Instant>,
    /// Whether it was reset since power-on.
    was_reset: bool,
    /// An event that persists.
    active_event: Option<Event>,
    /// It hangs: no more output.
    hung: bool,
    outgoing: Vec<u8>,
}

impl SimulatedFirmware for Firmware {
    type Config = SimulatorConfig;
    type Event = Event;

    fn new(config: SimulatorConfig, event_log: EventLog) -> Self {
        Self {
            at_mm: config.start_at_mm,
            report_mask: config.report_mask,
            config,
            event_log,
            state: State::Idle,
            modal: START_MODAL,
            motion: None,
            planned: VecDeque::new(),
            after_jog: None,
            homing_legs: VecDeque::new(),
            rx: Vec::new(),
            reply_at: None,
            pause: None,
            query: false,
            lit: None,
            overrides: [100; 3],
            reports_overrides: false,
            reports: 0,
            homed: false,
            must_home: false,
            door_open: false,
            restored_at: None,
            was_reset: false,
            active_event: None,
            hung: false,
            outgoing: Vec::new(),
        }
    }

    fn power_on(&mut self, now: Instant) {
        self.event_log.record(now, LogEvent::PoweredOn);
        self.hung = false;
        self.boot(now);
    }

    /// Motion and laser off, in any state.
    fn power_off(&mut self, now: Instant) {
        self.halt(now);
        self.turn_laser_off(now);
        self.outgoing.clear();
    }

    fn receive(&mut self, bytes: &[u8], now: Instant) {
        self.receive_bytes(bytes, now);
    }

    fn advance_time(&mut self, now: Instant) {
        self.advance(now);
        if let Some(pause) = self.pause {
            if now < pause.until {
                return self.update_light(now);
            }
            self.end_pause(pause, now);
        }
        self.end_restoring(now);
        self.read_lines(now);
        if self.query && !self.ignores_queries() {
            self.query = false;
            self.report(now);
        }
        self.update_light(now);
    }

    fn take_outgoing(&mut self) -> Vec<u8> {
        let output = std::mem::take(&mut self.outgoing);
        if self.hung { Vec::new() } else { output }
    }

    fn trigger_event(&mut self, event: Event, now: Instant) {
        match event {
            Event::Alarm(code) => self.raise(code, now),
            Event::StrayLight => self.emit_unrequested(now),
            Event::Override(byte) => self.change_override(byte, now),
            Event::DoorOpen(open) => self.door_open = open,
            Event::Stall => {
                self.stall(now);
                self.active_event = Some(event);
            }
            Event::NoAcknowledgement | Event::EmergencyStop => self.active_event = Some(event),
        }
    }

    fn repair(&mut self) {
        self.active_event = None;
    }
}

impl Firmware {
    fn emit_unrequested(&mut self, now: Instant) {
        self.modal =
            Modal { spindle: Spindle::Constant, speed: self.config.max_spindle, feeds: true, ..self.modal };
        self.update_light(now);
    }

    /// The axis stops while the firmware keeps counting steps.
    fn stall(&mut self, now: Instant) {
        if let Some(motion) = self.motion {
            self.at_mm = motion.at(now).0;
        }
    }

    /// Whether queries are not answered: GRBL does not answer them during homing and limit alarms, and grblHAL not
    /// during homing unless bit 12 of `$10` is set.
    fn ignores_queries(&self) -> bool {
        match (self.config.dialect, self.state) {
            (Dialect::Grbl, State::Home | State::Critical) => true,
            (Dialect::GrblHal, State::Home) => self.report_mask & (1 << 12) == 0,
            _ => false,
        }
    }

    fn advance(&mut self, now: Instant) {
        loop {
            let Some(motion) = self.motion else { return };
            if self.active_event == Some(Event::Stall) {
                return;
            }
            if now < motion.ends_at() {
                self.at_mm = motion.at(now).0;
                return self.event_log.record_position(now, self.at_mm);
            }
            let ended_at = motion.ends_at();
            self.at_mm = self.snapped(motion.at(ended_at).0);
            self.motion = None;
            self.event_log.record(ended_at, LogEvent::MotionEnded(self.at_mm));
            self.motion_ended(ended_at, now);
        }
    }

    fn motion_ended(&mut self, ended_at: Instant, now: Instant) {
        match self.state {
            State::Home => self.homing_leg_ended(now),
            State::Jog if self.after_jog.is_some() => {
                self.planned.clear();
                self.state = self.after_jog.take().unwrap_or(State::Idle);
            }
            State::Run | State::Jog => {
                self.planned.pop_front();
                match self.planned.front().copied() {
                    Some(next) => self.begin(next.target_mm, next.speed_mm_s, ended_at),
                    None => self.state = State::Idle,
                }
            }
            _ => {}
        }
    }

    fn snapped(&self, at_mm: f64) -> f64 {
        (at_mm * self.config.steps_per_mm).round() / self.config.steps_per_mm
    }

    /// Machine space ends at 0, the switch.
    fn home(&mut self, now: Instant) {
        self.state = State::Home;
        self.homed = false;
        // The axis does not know its position; only the simulation knows the distance to the switch.
        self.homing_legs = VecDeque::from([0.0, -self.config.pull_off_mm]);
        self.homing_leg_ended(now);
    }

    fn homing_leg_ended(&mut self, now: Instant) {
        match self.homing_legs.pop_front() {
            Some(_) if !self.config.switch_works && self.homing_legs.is_empty() => self.homing_failed(9, now),
            Some(to_mm) => self.begin(to_mm, self.config.homing_mm_s, now),
            None => {
                self.state = State::Idle;
                (self.homed, self.must_home) = (true, false);
                self.send_line("ok");
            }
        }
    }

    fn begin(&mut self, to_mm: f64, speed_mm_s: f64, now: Instant) {
        self.event_log.record(now, LogEvent::MotionBegan(self.at_mm));
        self.motion = Some(Motion::travel(self.at_mm, to_mm, speed_mm_s, self.config.acceleration_mm_s2, now));
    }

    /// Stops abruptly, and discards planned moves and received bytes.
    fn halt(&mut self, now: Instant) {
        if let Some(motion) = self.motion.take() {
            if self.active_event != Some(Event::Stall) {
                self.at_mm = self.snapped(motion.at(now).0);
            }
            self.event_log.record(now, LogEvent::MotionEnded(self.at_mm));
        }
        self.planned.clear();
        self.homing_legs.clear();
        self.rx.clear();
        (self.after_jog, self.reply_at, self.restored_at, self.pause) = (None, None, None, None);
        self.query = false;
    }

    /// Laser according to `laser_mode.md`: in G1 only, M3 also at rest, M4 in motion, off in a hold once at rest.
    fn update_light(&mut self, now: Instant) {
        let moving = self.motion.is_some();
        let held = matches!(self.state, State::Hold | State::Door) && !moving && self.restored_at.is_none();
        let is_output_on = match self.modal.spindle {
            Spindle::Off => false,
            Spindle::Constant => self.modal.feeds && !held,
            Spindle::Dynamic => self.modal.feeds && moving,
        };
        let lit = (is_output_on && self.modal.speed > 0.0).then(|| {
            // Per cent of the programmed speed, up to full power.
            (self.modal.speed / self.config.max_spindle * f64::from(self.overrides[2]) / 100.0).min(1.0)
        });
        if lit == self.lit {
            return;
        }
        self.lit = lit;
        self.event_log.record(now, lit.map_or(LogEvent::LightOff, LogEvent::LightOn));
    }

    fn turn_laser_off(&mut self, now: Instant) {
        self.modal = START_MODAL;
        self.update_light(now);
    }

    fn send_line(&mut self, line: &str) {
        if line == "ok" && self.active_event == Some(Event::NoAcknowledgement) {
            return;
        }
        self.outgoing.extend_from_slice(line.as_bytes());
        self.outgoing.extend_from_slice(b"\r\n");
    }
}
