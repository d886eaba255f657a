//! Messages from a controller that is ready.

use std::time::Instant;

use super::{Activity, LastReport, LineKind, Link, OwnReset, Pending, Session, Stopping, Travel};
use crate::drivers::grbl::Dialect;
use crate::drivers::grbl::fault::{Device, Fault};
use crate::drivers::grbl::protocol::{MachineState, Message, OVERRIDES_OFF, Position, Report};
use crate::drivers::progress::Progress;
use crate::params::{GRBL_BRAKING_SLACK, GRBL_RESET_AGAIN, GRBL_SILENCE, GRBL_START, GRBL_STRAY_REPORTS};

/// `ALARM:3`: reset while moving.
const ALARM_RESET_MOVING: u32 = 3;
/// `ALARM:6`: reset while homing.
const ALARM_RESET_HOMING: u32 = 6;
/// `ALARM:1`: a limit switch.
const ALARM_HARD_LIMIT: u32 = 1;
/// `ALARM:2`: the only alarm that keeps the position.
const ALARM_SOFT_LIMIT: u32 = 2;
/// `error:46`: unlocked by homing only.
const ERROR_HOMING_REQUIRED: u32 = 46;
/// Sent after a limit alarm, once a reset has effect again.
const RESET_TO_CONTINUE: &str = "Reset to continue";

impl Session {
    pub(super) fn message(&mut self, message: Message, began_at: Instant, now: Instant) {
        match self.link {
            Link::Down => return,
            Link::Opening(_) => return self.opening_message(message, began_at, now),
            Link::Up => {}
        }
        match &message {
            Message::Garbage(text) => self.foreign_lines.last_is_damaged(text),
            _ => self.foreign_lines.last_is_valid(),
        }
        match message {
            Message::Banner(_) => self.banner(now),
            Message::Ok => match self.pending.pop_front() {
                Some(pending) => {
                    self.note_response(now);
                    self.resting_since = None;
                    self.answered(&pending, now);
                }
                None => self.garbage("ok".to_owned(), now),
            },
            Message::Error(code) => match self.pending.pop_front() {
                Some(pending) => {
                    self.note_response(now);
                    self.resting_since = None;
                    self.refused(pending, code, now);
                }
                None => self.garbage(format!("error:{code}"), now),
            },
            Message::Alarm(code) => self.alarm(code, now),
            Message::Report(report) => self.report(report, began_at, now),
            Message::Garbage(text) => self.garbage(text, now),
            Message::Feedback { key, text } if key == "MSG" && text.contains(RESET_TO_CONTINUE) => {
                if self.reset_again_at.take().is_some() {
                    self.quiet_until = None;
                    self.soft_reset(now);
                }
            }
            Message::Setting { .. } | Message::Feedback { .. } | Message::Nothing => {}
        }
    }

    /// An answer to a line also shows that the controller responds: grblHAL's queries wait while it executes a line.
    fn note_response(&mut self, now: Instant) {
        self.queries.unanswered_since = self.queries.unanswered_since.map(|_| now);
    }

    /// A reset has occurred: ours, the one that comes with an alarm, or a spontaneous one.
    fn banner(&mut self, now: Instant) {
        let moving = matches!(self.activity, Activity::Travel(_) | Activity::Homing { .. });
        let ours = self.reset.is_some_and(|reset| {
            reset.awaited || (!moving && now.saturating_duration_since(reset.sent_at) < GRBL_SILENCE)
        });
        let was_faulted = self.fault.is_some();
        self.pending.clear();
        self.activity = match self.activity {
            Activity::Stopping(stopping) if stopping.after_reset => {
                let until = now + GRBL_BRAKING_SLACK;
                Activity::Stopping(Stopping { until, only_jog: false, after_reset: false, idle_once: false })
            }
            _ => Activity::Rest,
        };
        (self.laser_lease, self.laser_off_deadline, self.stray_reports) = (None, None, 0);
        (self.quiet_until, self.reset_again_at) = (None, None);
        self.queries.unanswered_since = None;
        if let Some(last_report) = &mut self.last_report {
            let locked = self.reset.is_some_and(|reset| reset.locked);
            last_report.state = if locked { MachineState::Alarm } else { MachineState::Idle };
        }
        if let Some(reset) = &mut self.reset {
            reset.awaited = false;
        }
        if ours || was_faulted {
            // The state before the reset is obsolete: the next report decides.
            self.query(now);
        } else {
            self.homed = false;
            tracing::warn!(port_name = self.port_name, "controller restarted unexpectedly");
            self.fault = Some(Fault::Restarted);
        }
    }

    fn answered(&mut self, pending: &Pending, now: Instant) {
        match pending.kind {
            LineKind::Travel => {
                if let Activity::Travel(travel) = &mut self.activity {
                    (travel.accepted_at, travel.progress) = (Some(now), Progress::begun(now));
                }
            }
            LineKind::Home => {
                if let Activity::Homing { done_at } = &mut self.activity {
                    *done_at = Some(now);
                }
                self.query(now);
            }
            LineKind::LaserOff => (self.laser_lease, self.laser_off_deadline) = (None, None),
            LineKind::Unlock => self.unlocked(),
            LineKind::LaserOn | LineKind::Build | LineKind::Settings => {}
        }
    }

    fn unlocked(&mut self) {
        self.clearing = false;
        self.fault = self.fault.take().filter(|fault| !matches!(fault, Fault::Alarm { .. }));
    }

    /// A line was refused: reported to the caller if it is still waiting, otherwise as a fault of the device that sent
    /// it.
    fn refused(&mut self, pending: Pending, code: u32, now: Instant) {
        if pending.kind == LineKind::Unlock && code == ERROR_HOMING_REQUIRED {
            // Not a fault: it can be homed, and nothing else.
            self.must_home = true;
            return self.unlocked();
        }
        match pending.kind {
            LineKind::Travel | LineKind::Home => self.activity = Activity::Rest,
            // Whether any word of the line had an effect is unknown.
            LineKind::LaserOn => self.turn_laser_off(now),
            LineKind::LaserOff => self.soft_reset(now),
            LineKind::Unlock => self.clearing = false,
            LineKind::Build | LineKind::Settings => {}
        }
        let by = match pending.kind {
            LineKind::LaserOn | LineKind::LaserOff => Device::Laser,
            _ => Device::Stage,
        };
        let refusal = Fault::Refused { command: pending.text, code, by };
        if self.waited_for == Some(pending.ticket) {
            self.refusal = Some(refusal);
        } else if self.fault.is_none() {
            self.fault = Some(refusal);
        }
    }

    fn alarm(&mut self, code: u32, now: Instant) {
        let dialect = self.dialect();
        let quiet_until = now + dialect.alarm_pause();
        self.quiet_until = Some(quiet_until);
        let by_reset = code == ALARM_RESET_MOVING || code == ALARM_RESET_HOMING || dialect.requires_homing(code);
        self.must_home |= dialect == Dialect::GrblHal && dialect.requires_homing(code);
        if by_reset && let Some(reset @ OwnReset { awaited: true, .. }) = &mut self.reset {
            reset.answer_by = quiet_until + GRBL_SILENCE;
            (reset.locked, self.homed) = (true, false);
            return;
        }
        if dialect.requires_homing(code) && self.activity == Activity::Rest {
            // As after power-on: not a fault, but no position either.
            self.homed = false;
            return;
        }
        tracing::warn!(port_name = self.port_name, code, "controller raised an alarm");
        self.homed = self.homed && code == ALARM_SOFT_LIMIT;
        // Pending lines are kept: their answers may still come.
        self.activity = Activity::Rest;
        self.laser_off_deadline = None;
        if dialect.turns_laser_off(code) {
            self.laser_lease = None;
        }
        self.fault = Some(Fault::Alarm { code, dialect });
        if matches!(code, ALARM_HARD_LIMIT | ALARM_SOFT_LIMIT) {
            self.reset_again_at = Some(quiet_until + GRBL_RESET_AGAIN);
        }
        if !dialect.resets_after(code) {
            self.soft_reset(now);
        }
    }

    pub(super) fn report(&mut self, report: Report, began_at: Instant, now: Instant) {
        let queried_at = self.queries.last_sent_at.unwrap_or(began_at).min(began_at);
        self.queries.unanswered_since = None;
        if report.state == MachineState::Starting {
            return;
        }
        if matches!(report.state, MachineState::Sleep | MachineState::Check) {
            let reason = format!("the controller is in the state {:?}", report.state);
            return self.down(Fault::Disconnected { reason });
        }
        let Some(machine_mm) = self.machine_mm(&report) else { return };
        // The report was generated between query and answer.
        let at = queried_at + (began_at - queried_at) / 2;
        let latest = LastReport { state: report.state, machine_mm, queried_at, at, received_at: now };
        if !self.accept(latest, now) {
            return;
        }
        if matches!(report.state, MachineState::Idle | MachineState::Alarm) {
            self.resting_since.get_or_insert(queried_at);
        } else {
            self.resting_since = None;
        }
        self.undo_overrides(&report);
        self.watch_stray_light(report.spindle, now);
        self.unlock_if_no_fault(report.state, now);
        self.follow(report.state, machine_mm, queried_at, now);
        if self.activity == Activity::Rest && !self.is_confirmed && !report.state.in_motion() {
            self.query(now);
        }
    }

    /// Machine position of the axis; `None` while the work offset, which comes with some reports, is unknown.
    pub(super) fn machine_mm(&mut self, report: &Report) -> Option<f64> {
        if let Some(offset_mm) = report.offset_mm {
            // It is constant over many reports: a new one is accepted when it is reported twice.
            if self.unconfirmed_offset_mm == Some(offset_mm) {
                (self.offset_mm, self.offset_known) = (offset_mm, true);
            }
            self.unconfirmed_offset_mm = Some(offset_mm);
        }
        let idx = self.config.axis.idx();
        match report.position {
            Position::Machine(axes_mm) => Some(axes_mm[idx]),
            Position::Work(axes_mm) => self.offset_known.then(|| axes_mm[idx] + self.offset_mm[idx]),
        }
    }

    /// Applies the report to the current activity.
    fn follow(&mut self, state: MachineState, machine_mm: f64, queried_at: Instant, now: Instant) {
        match self.activity {
            Activity::Rest => {}
            Activity::Travel(travel) => self.follow_travel(travel, state, machine_mm, queried_at, now),
            Activity::Homing { done_at } => {
                if done_at.is_some_and(|done_at| queried_at >= done_at) && state == MachineState::Idle {
                    (self.activity, self.homed, self.must_home) = (Activity::Rest, true, false);
                }
            }
            Activity::Stopping(stopping) if !self.reset_awaited() => self.follow_stop(stopping, state, now),
            Activity::Stopping(_) => {}
        }
    }

    /// At rest a reset completes the stop: it clears a held move, unread lines and the laser. After a jog alone there
    /// is nothing to clear.
    fn follow_stop(&mut self, stopping: Stopping, state: MachineState, now: Instant) {
        match state {
            _ if state.in_motion() => {
                self.activity = Activity::Stopping(Stopping { idle_once: false, ..stopping })
            }
            MachineState::Idle if !stopping.idle_once => {
                self.activity = Activity::Stopping(Stopping { idle_once: true, ..stopping });
            }
            MachineState::Idle if stopping.only_jog => self.activity = Activity::Rest,
            _ => self.soft_reset(now),
        }
    }

    fn follow_travel(
        &mut self,
        mut travel: Travel,
        state: MachineState,
        machine_mm: f64,
        queried_at: Instant,
        now: Instant,
    ) {
        let Some(accepted_at) = travel.accepted_at.filter(|accepted_at| queried_at >= *accepted_at) else {
            return;
        };
        let under_way = matches!(state, MachineState::Run | MachineState::Jog);
        let is_held = !(under_way || state == MachineState::Idle);
        travel.progress.report(is_held || machine_mm != travel.last_mm, now);
        travel.last_mm = machine_mm;
        self.activity = Activity::Travel(travel);
        let at_target = (machine_mm - travel.path.to_mm).abs() <= self.rounding_mm();
        let short = match state {
            MachineState::Idle if at_target => {
                (self.activity, self.is_confirmed) = (Activity::Rest, true);
                return;
            }
            MachineState::Idle => queried_at - accepted_at > GRBL_START,
            _ => under_way && travel.progress.has_stalled(now),
        };
        if short {
            let actual_mm = self.position_mm().unwrap_or(machine_mm);
            self.homed = false;
            self.raise(Fault::Stalled { target_mm: travel.target_mm, actual_mm }, now);
        }
    }

    /// An override was changed at the machine: it would change accepted speeds and the laser's power.
    fn undo_overrides(&mut self, report: &Report) {
        if report.overrides.is_some_and(|percents| percents != [100; 3]) {
            tracing::warn!(
                port_name = self.port_name,
                "feed or power was overridden at the controller; set back to 100 %"
            );
            self.outgoing.extend_from_slice(&OVERRIDES_OFF);
        }
    }

    /// GRBL reports its output power (`FS`); light that was not requested is reset.
    fn watch_stray_light(&mut self, spindle: Option<f64>, now: Instant) {
        // Verified for GRBL's source only; some drivers of grblHAL report a programmed speed for a spindle at rest.
        let verified = self.dialect() == Dialect::Grbl;
        let is_requested = self.laser_lease.is_some() || self.reset_awaited();
        if !verified || is_requested || spindle.is_none_or(|speed| speed == 0.0) {
            self.stray_reports = 0;
            return;
        }
        self.stray_reports += 1;
        if self.stray_reports >= GRBL_STRAY_REPORTS && self.fault.is_none() {
            self.raise(Fault::StrayLight, now);
        }
    }

    /// Counts a line that is not part of the protocol; many within a short time end the link.
    pub(super) fn garbage(&mut self, received: String, now: Instant) {
        // After a fault the answers to discarded lines may still come.
        if self.fault.is_some() || self.reset_awaited() {
            return;
        }
        if self.foreign_lines.count(now) {
            self.down(Fault::Unreadable { received });
        }
    }
}
