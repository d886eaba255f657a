//! Messages from a controller that is ready.

use std::time::Instant;

use super::{Activity, Device, LastReport, LineKind, Link, Pending, Session, Stopping, Travel};
use crate::StageError;
use crate::drivers::marlin::protocol::{Message, Position, message_from_line};
use crate::lines::line_reader::{ReceivedLine, shortened};
use crate::params::{MARLIN_RESEND_PAUSE, MARLIN_RESENDS};

/// Largest difference in steps between the two forms of a position: both are rounded.
const SAME_STEPS: i64 = 2;

/// The firmware prints positions with two decimals, mm.
const PRINTED_MM: f64 = 0.0051;

impl Session {
    pub(super) fn line(&mut self, line: &ReceivedLine, now: Instant) {
        let message = message_from_line(&line.text);
        match self.link {
            Link::Down => {}
            Link::Opening(_) => self.opening_message(message, line.began_at, now),
            Link::Up => self.message(message, line.began_at, now),
        }
    }

    fn message(&mut self, message: Message, began_at: Instant, now: Instant) {
        match &message {
            Message::Garbage(text) => self.foreign_lines.last_is_damaged(text),
            _ => self.foreign_lines.last_is_valid(),
        }
        match message {
            // Line numbers and settings are lost with it: it is opened again.
            Message::Start => self.down(StageError::Restarted),
            Message::Ok(number) => self.ok(number, now),
            Message::Resend(number) => self.resend(number, now),
            Message::Busy => self.is_busy(now),
            Message::Position(position) => self.position(position, began_at, now),
            Message::Halted(text) => {
                self.laser_lease = None;
                let reason = format!("it halted itself: {}; press its reset button", shortened(&text));
                self.down(StageError::Disconnected { reason });
            }
            Message::Error(text) => self.warned("Error", &text, now),
            Message::EndstopHit(text) => self.warned("endstop", &text, now),
            Message::Unknown(_) => {
                if let Some(pending) = &mut self.pending {
                    pending.unknown = true;
                }
            }
            Message::Garbage(text) => self.garbage(text, now),
            Message::Capability(..) | Message::Text(_) => {}
        }
    }

    fn warned(&mut self, flag: &str, text: &str, now: Instant) {
        self.raise(StageError::Warned { flag: flag.to_owned(), meaning: shortened(text) }, now);
    }

    fn ok(&mut self, number: Option<u32>, now: Instant) {
        let Some(pending) = self.pending.take() else { return self.garbage("ok".to_owned(), now) };
        // Belongs to a line that is being resent, or to an earlier one.
        if pending.resend_at.is_some() || number.is_some_and(|number| number != pending.number) {
            self.pending = Some(pending);
            return;
        }
        if pending.unknown {
            return self.rejected(pending, now);
        }
        self.acknowledged(&pending, now);
    }

    pub(super) fn resend(&mut self, number: u32, now: Instant) {
        match &mut self.pending {
            Some(pending) if pending.number == number && pending.n_resends < MARLIN_RESENDS => {
                pending.n_resends += 1;
                pending.resend_at = Some(now + MARLIN_RESEND_PAUSE);
            }
            // It counts from the beginning: another controller, or the same after a reset whose banner was lost.
            _ if number <= 1 => self.down(StageError::Restarted),
            _ => self.down(StageError::Unreadable { received: format!("Resend: {number}") }),
        }
    }

    fn acknowledged(&mut self, pending: &Pending, now: Instant) {
        match pending.queued.kind {
            LineKind::Settle => {
                match &mut self.activity {
                    Activity::Travel(Travel { settled_at, .. })
                    | Activity::Stopping(Stopping { settled_at, .. }) => *settled_at = Some(now),
                    _ => {}
                }
                self.position_queried_at = None;
            }
            LineKind::Home => {
                if let Activity::Homing { done_at, .. } = &mut self.activity {
                    *done_at = Some(now);
                }
                self.position_queried_at = None;
            }
            LineKind::LaserOff => (self.laser_lease, self.laser_off_deadline) = (None, None),
            LineKind::Query
            | LineKind::Piece
            | LineKind::Setting
            | LineKind::Position
            | LineKind::LaserOn
            | LineKind::LightKeepalive => {}
        }
    }

    /// A command that the firmware does not have.
    fn rejected(&mut self, pending: Pending, now: Instant) {
        let by = match pending.queued.kind {
            LineKind::LaserOn | LineKind::LaserOff => {
                // It has no such output, hence no laser.
                (self.laser_lease, self.laser_off_deadline) = (None, None);
                Device::Laser
            }
            _ => {
                self.begin_stop(None, now);
                if matches!(self.activity, Activity::Homing { .. }) {
                    self.activity = Activity::Rest;
                }
                Device::Stage
            }
        };
        let refusal = StageError::Rejected {
            command: pending.queued.text,
            reason: "unknown command".to_owned(),
            meaning: "the firmware was built without it".to_owned(),
        };
        if self.waited_for == Some(pending.queued.ticket) {
            self.refusal = Some(refusal);
        } else if self.fault.is_none() {
            self.fault = Some((refusal, by));
        }
    }

    /// A position is accepted if its two forms agree with each other and with what was sent: there is no other
    /// protection of a line from Marlin against a damaged digit.
    fn position(&mut self, position: Position, began_at: Instant, now: Instant) {
        let Some(queried_at) =
            self.pending.as_ref().filter(|pending| pending.queued.kind == LineKind::Position).map(|p| p.sent_at)
        else {
            return self.garbage("an unrequested position".to_owned(), now);
        };
        let idx = self.config.axis.idx();
        let (steps, planned_mm) = (position.steps[idx], position.planned_mm[idx]);
        if !self.is_plausible(steps, planned_mm) {
            return self.garbage(format!("position {planned_mm} mm, {steps} steps"), now);
        }
        let at = queried_at + began_at.saturating_duration_since(queried_at) / 2;
        self.last_report = Some(LastReport { steps, at });
        self.follow(steps, queried_at, now);
    }

    fn is_plausible(&self, steps: i64, planned_mm: f64) -> bool {
        let slack = SAME_STEPS + (PRINTED_MM * self.config.steps_per_mm).ceil() as i64;
        let planned_steps = (planned_mm * self.config.steps_per_mm).round() as i64;
        let agrees = |expected: i64| (planned_steps - expected).abs() <= slack;
        match self.activity {
            Activity::Travel(Travel { settled_at: None, sent_steps, last_steps, .. }) => {
                let way = last_steps.min(sent_steps) - SAME_STEPS..=last_steps.max(sent_steps) + SAME_STEPS;
                agrees(sent_steps) && way.contains(&steps)
            }
            Activity::Stopping(Stopping { settled_at: None, is_quick_stop: false, .. }) => {
                let last_steps = self.last_report.map_or(steps, |last_report| last_report.steps);
                let way = last_steps.min(planned_steps) - slack..=last_steps.max(planned_steps) + slack;
                way.contains(&steps)
            }
            Activity::Homing { done_at: None, .. } => true,
            _ => agrees(steps),
        }
    }

    /// Applies the position to the current activity.
    fn follow(&mut self, steps: i64, queried_at: Instant, now: Instant) {
        match self.activity {
            Activity::Rest | Activity::Held(_) => {}
            Activity::Travel(travel) => self.follow_travel(travel, steps, queried_at, now),
            Activity::Homing { done_at, .. } => {
                if done_at.is_some_and(|at| queried_at >= at) {
                    self.activity = Activity::Rest;
                    self.homed = self.fault.is_none();
                }
            }
            Activity::Stopping(Stopping { settled_at, then, .. }) => {
                if settled_at.is_some_and(|at| queried_at >= at) {
                    self.activity = then.map_or(Activity::Rest, Activity::Held);
                }
            }
        }
    }

    fn follow_travel(&mut self, mut travel: Travel, steps: i64, queried_at: Instant, now: Instant) {
        travel.progress.report(steps != travel.last_steps, now);
        travel.last_steps = steps;
        self.activity = Activity::Travel(travel);
        let at_target = (steps - travel.target_steps).abs() <= SAME_STEPS;
        let settled = travel.settled_at.is_some_and(|at| queried_at >= at);
        if settled && at_target {
            self.activity = Activity::Rest;
        } else if settled || (!at_target && travel.progress.has_stalled(now)) {
            let actual_mm = self.mm_from_steps(steps);
            self.raise(StageError::Stalled { target_mm: travel.target_mm, actual_mm }, now);
        } else if at_target
            && travel.sent_steps == travel.target_steps
            && travel.settled_at.is_none()
            && !self.queued.iter().any(|queued| queued.kind == LineKind::Settle)
        {
            self.enqueue("M400".to_owned(), LineKind::Settle);
        }
    }

    /// Counts a line that is not part of the protocol; many within a short time end the link.
    pub(super) fn garbage(&mut self, received: String, now: Instant) {
        if self.foreign_lines.count(now) {
            self.down(StageError::Unreadable { received });
        }
    }
}
