//! Messages from a device that is ready.

use std::time::Instant;

use super::{Activity, CommandKind, LastReport, Link, Pending, Session, Travel};
use crate::StageError;
use crate::drivers::progress::Progress;
use crate::drivers::zaber::meanings::{DRIVER_OFF, Severity, flag_meaning, reason_meaning};
use crate::drivers::zaber::protocol::{Kind, Message, Status, message_from_line};
use crate::lines::line_reader::{ReceivedLine, shortened};
use crate::params::ZABER_SETTLED_STEPS;

impl Session {
    /// A line, whose first byte was received at `line.began_at`.
    pub(super) fn line(&mut self, line: &ReceivedLine, now: Instant) {
        if line.text.trim().is_empty() {
            return;
        }
        let Some(message) = message_from_line(&line.text) else { return self.garbage(&line.text, now) };
        // From the first answer on every line has a checksum; one without it lost its end.
        if matches!(self.link, Link::Up) && !message.checked {
            return self.garbage(&line.text, now);
        }
        if message.address != self.config.address {
            return;
        }
        let Some(message) = self.joined(message) else { return };
        match self.link {
            Link::Down => {}
            Link::Opening(_) => self.opening_message(&message, now),
            Link::Up => {
                self.foreign_lines.last_is_valid();
                self.message(&message, line.began_at, now);
            }
        }
    }

    /// Joins continued lines; returns a complete message, or `None` so far.
    fn joined(&mut self, message: Message) -> Option<Message> {
        let whole = match (self.partial.take(), &message.kind) {
            (Some(partial), Kind::Info { continues: true }) => {
                let text = format!("{} {}", partial.text, message.text);
                Message { text, has_continuation: message.has_continuation, ..partial }
            }
            // The beginning is lost, or another message came in between: the partial message is discarded.
            (_, Kind::Info { continues: true }) => return None,
            (_, _) => message,
        };
        if whole.has_continuation {
            self.partial = Some(whole);
            return None;
        }
        Some(whole)
    }

    fn message(&mut self, message: &Message, began_at: Instant, now: Instant) {
        match &message.kind {
            Kind::Info { .. } => {}
            // Unsolicited values are not used; the value is asked for at once.
            Kind::Alert(_) => {
                if message.axis == self.config.axis || message.axis == 0 {
                    self.pending.retain(|pending| pending.what != CommandKind::Position);
                    self.query_position(now);
                }
            }
            Kind::Reply { accepted, status } => {
                let at = self.pending.iter().position(|pending| Some(pending.id) == message.id);
                // The answer to an abandoned command.
                let Some(pending) = at.and_then(|at| self.pending.remove(at)) else { return };
                self.received_at = Some(now);
                if *accepted {
                    self.answered(&pending, &message.text, status, began_at, now);
                } else {
                    self.rejected(pending, &message.text, status, now);
                }
            }
        }
    }

    fn answered(&mut self, pending: &Pending, text: &str, status: &Status, began_at: Instant, now: Instant) {
        match pending.what {
            CommandKind::Position => {
                let Ok(steps) = text.parse::<i64>() else { return self.garbage(text, now) };
                // The position was read between query and answer.
                let at = pending.sent_at + began_at.saturating_duration_since(pending.sent_at) / 2;
                self.seen = Some(LastReport { steps, busy: status.busy, at });
                if !self.evaluate_flag(&status.flag, pending.sent_at, now) {
                    self.follow(steps, status.busy, pending.sent_at, now);
                }
            }
            CommandKind::Serial => self.check_serial(text),
            CommandKind::Move => {
                if let Activity::Travel(travel) = &mut self.activity {
                    (travel.accepted_at, travel.progress) = (Some(now), Progress::begun(now));
                }
                self.query_position(now);
            }
            CommandKind::Home => {
                if let Activity::Homing { accepted_at, .. } = &mut self.activity {
                    *accepted_at = Some(now);
                }
                self.query_position(now);
            }
            CommandKind::Clear => self.query_position(now),
            CommandKind::Stop | CommandKind::Opening => {}
        }
    }

    fn check_serial(&mut self, text: &str) {
        let expected = self.machine.as_ref().map(|machine| machine.serial.clone()).unwrap_or_default();
        if text != expected {
            let (expected, found) = (format!("the device {expected}"), format!("the device {}", shortened(text)));
            self.down(StageError::WrongDevice { port_name: self.port_name.clone(), expected, found });
        }
    }

    fn rejected(&mut self, pending: Pending, reason: &str, status: &Status, now: Instant) {
        if matches!(pending.what, CommandKind::Move | CommandKind::Home) {
            self.activity = Activity::Rest;
        }
        if matches!(pending.what, CommandKind::Clear) {
            self.clearing = false;
        }
        if reason == "BADMESSAGE" && matches!(pending.what, CommandKind::Position | CommandKind::Serial) {
            return;
        }
        let refusal = match flag_meaning(&status.flag) {
            // The flag says why the driver is off.
            (Severity::Fault, meaning) if reason == DRIVER_OFF => {
                let fault = StageError::Warned { flag: status.flag.clone(), meaning: meaning.to_owned() };
                self.raise(fault.clone(), now);
                fault
            }
            _ => StageError::Rejected {
                command: pending.text,
                reason: shortened(reason),
                meaning: reason_meaning(reason).to_owned(),
            },
        };
        if self.waited_for == Some(pending.ticket) {
            self.refusal = Some(refusal);
        } else if self.fault.is_none() {
            self.fault = Some(refusal);
        }
    }

    /// Evaluates the flag of an answer; returns whether it is a fault.
    pub(super) fn evaluate_flag(&mut self, flag: &str, queried_at: Instant, now: Instant) -> bool {
        let (severity, meaning) = flag_meaning(flag);
        self.last_flag_unreferenced = severity == Severity::Unreferenced;
        match severity {
            Severity::Fault => {
                let fault = match self.activity {
                    // A flag from before: the motion that was started clears it.
                    Activity::Travel(Travel { accepted_at, .. }) | Activity::Homing { accepted_at, .. }
                        if accepted_at.is_none_or(|at| queried_at < at) =>
                    {
                        return false;
                    }
                    Activity::Travel(travel) if flag == "FS" => StageError::Stalled {
                        target_mm: travel.target_mm,
                        actual_mm: self.position_mm().unwrap_or_default(),
                    },
                    _ => StageError::Warned { flag: flag.to_owned(), meaning: meaning.to_owned() },
                };
                self.raise(fault, now);
                true
            }
            Severity::Unreferenced if self.homed => {
                // The reference is lost: power was off in between.
                self.raise(StageError::Restarted, now);
                true
            }
            Severity::Unreferenced | Severity::Interrupted | Severity::Note => {
                if self.clearing {
                    (self.clearing, self.fault) = (false, None);
                }
                false
            }
        }
    }

    /// Applies the position to the current activity.
    fn follow(&mut self, steps: i64, busy: bool, queried_at: Instant, now: Instant) {
        match self.activity {
            Activity::Rest | Activity::Held(_) => {}
            Activity::Travel(travel) => self.follow_travel(travel, steps, busy, queried_at, now),
            Activity::Homing { accepted_at, .. } => {
                if !busy && accepted_at.is_some_and(|at| queried_at >= at) {
                    self.end_homing(now);
                }
            }
            Activity::Stopping { sent_at, then } => {
                if !busy
                    && queried_at >= sent_at
                    && !self.pending.iter().any(|pending| pending.what == CommandKind::Stop)
                {
                    self.activity = then.map_or(Activity::Rest, Activity::Held);
                }
            }
        }
    }

    /// Homing ended. A device that was power-cycled in the meantime is at rest without a reference.
    fn end_homing(&mut self, now: Instant) {
        self.activity = Activity::Rest;
        if self.last_flag_unreferenced {
            self.raise(StageError::Restarted, now);
        } else {
            self.homed = true;
        }
    }

    fn follow_travel(&mut self, mut travel: Travel, steps: i64, busy: bool, queried_at: Instant, now: Instant) {
        if travel.accepted_at.is_none_or(|accepted_at| queried_at < accepted_at) {
            return;
        }
        travel.progress.report(steps != travel.last_steps, now);
        travel.last_steps = steps;
        self.activity = Activity::Travel(travel);
        let at_target = (steps - travel.target_steps).abs() as f64 <= ZABER_SETTLED_STEPS;
        if !busy && at_target {
            self.activity = Activity::Rest;
        } else if !busy || travel.progress.has_stalled(now) {
            let actual_mm = self.mm_from_steps(steps);
            self.raise(StageError::Stalled { target_mm: travel.target_mm, actual_mm }, now);
        }
    }

    /// Counts a damaged or foreign line; many within a short time end the link.
    pub(super) fn garbage(&mut self, received: &str, now: Instant) {
        let received = shortened(received);
        match &mut self.link {
            Link::Down => return,
            Link::Opening(opening) => return opening.foreign_line(received, now),
            Link::Up => {}
        }
        self.partial = None;
        self.foreign_lines.last_is_damaged(&received);
        if self.foreign_lines.count(now) {
            self.down(StageError::Unreadable { received });
        }
    }
}
