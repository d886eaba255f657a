//! From the first soft reset to the first report: banner, identity, settings, position.

use std::time::Instant;

use super::{Activity, LineKind, Link, Queries, Session, being_opened};
use crate::drivers::grbl::Dialect;
use crate::drivers::grbl::fault::Fault;
use crate::drivers::grbl::identity::Description;
use crate::drivers::grbl::meanings::error_meaning;
use crate::drivers::grbl::protocol::{MachineState, Message, QUERY, RESET};
use crate::params::{GRBL_ANSWER_LIMIT, GRBL_BANNER_SETTLING, GRBL_RESET_PERIOD, GRBL_SILENCE};

/// Progress of an opening.
#[derive(Debug)]
pub struct Opening {
    since: Instant,
    reset_at: Instant,
    step: Step,
    /// The first position reported: it is accepted when it is reported twice.
    first_mm: Option<f64>,
    /// The first line that is not GRBL's.
    foreign: Option<(Instant, String)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Banner,
    /// The banner was received; another may follow.
    Settling {
        banner_at: Instant,
    },
    Build,
    Settings,
    Report,
}

impl Session {
    /// The line was opened: a soft reset stops the motion and turns off the laser left on by a terminated program.
    pub fn line_opened(&mut self, now: Instant) {
        self.should_be_open = false;
        self.reset_dialogue();
        (self.homed, self.must_home) = (false, false);
        (self.offset_known, self.unconfirmed_offset_mm) = (false, None);
        self.fault = Some(being_opened());
        self.outgoing = vec![RESET];
        self.link = Link::Opening(Opening {
            since: now,
            reset_at: now,
            step: Step::Banner,
            first_mm: None,
            foreign: None,
        });
    }

    /// The line could not be opened.
    pub fn line_unopened(&mut self, reason: String) {
        self.should_be_open = false;
        self.down(Fault::Disconnected { reason });
    }

    pub(super) fn opening_message(&mut self, message: Message, began_at: Instant, now: Instant) {
        let Link::Opening(opening) = &mut self.link else { return };
        match message {
            Message::Banner(_) => {
                (opening.step, opening.foreign) = (Step::Settling { banner_at: now }, None);
                self.pending.clear();
            }
            Message::Feedback { key, text } if key != "MSG" || opening.step == Step::Build => {
                self.description.feedback(&key, &text);
            }
            Message::Setting { number, value } => self.description.setting(number, &value),
            Message::Ok => self.opening_answered(now),
            Message::Error(code) => self.opening_refused(code),
            // While it starts it is not ready: it is queried again.
            Message::Report(report) if opening.step == Step::Report && report.state != MachineState::Starting => {
                // grblHAL reports the work offset in about every tenth report: it is not ready before that.
                let machine_mm = self.machine_mm(&report);
                let Link::Opening(opening) = &mut self.link else { return };
                if machine_mm.is_none() || opening.first_mm != machine_mm {
                    opening.first_mm = machine_mm;
                    return self.query(now);
                }
                self.reached(now);
                self.report(report, began_at, now);
            }
            Message::Garbage(text) => {
                opening.foreign.get_or_insert((now, text));
            }
            // The firmware is not known yet.
            Message::Alarm(code) => self.must_home = Dialect::GrblHal.requires_homing(code),
            Message::Feedback { .. } | Message::Report(_) | Message::Nothing => {}
        }
    }

    fn opening_answered(&mut self, now: Instant) {
        let Some(pending) = self.pending.pop_front() else { return };
        let checked = match pending.kind {
            LineKind::Build => self.description.check_name(&self.config, &self.port_name).map(|()| {
                self.send_line("$$".to_owned(), LineKind::Settings, now, now + self.config.open_limit);
                Step::Settings
            }),
            LineKind::Settings => self.description.machine(&self.config, &self.port_name).map(|machine| {
                self.machine = Some(machine);
                self.query(now);
                Step::Report
            }),
            // No other line is sent during the opening.
            _ => return,
        };
        match checked {
            Ok(next) => {
                if let Link::Opening(opening) = &mut self.link {
                    opening.step = next;
                }
            }
            Err(fault) => self.down(fault),
        }
    }

    fn opening_refused(&mut self, code: u32) {
        // An answer to a line sent before the reset is ignored.
        let Some(refused) = self.pending.pop_front() else { return };
        let command = refused.text;
        let expected = format!("an answer to `{command}`");
        let found = format!("error {code} ({})", error_meaning(code));
        self.down(Fault::WrongDevice { port_name: self.port_name.clone(), expected, found });
    }

    /// The controller is ready. Positions reported before are discarded.
    fn reached(&mut self, now: Instant) {
        self.link = Link::Up;
        self.fault = None;
        self.must_home &= self.dialect() == Dialect::GrblHal;
        (self.activity, self.last_report, self.is_confirmed) = (Activity::Rest, None, true);
        self.zero_at_machine_mm = self.config.zero_at_machine_mm;
        self.queries = Queries { last_sent_at: self.queries.last_sent_at.or(Some(now)), unanswered_since: None };
    }

    pub(super) fn opening_tick(&mut self, now: Instant) {
        let Link::Opening(opening) = &mut self.link else { return };
        let waited = now - opening.since;
        if let Some((_, text)) = opening.foreign.take_if(|(at, _)| now - *at > GRBL_SILENCE) {
            let expected = "GRBL 1.1 or grblHAL".to_owned();
            return self.down(Fault::WrongDevice {
                port_name: self.port_name.clone(),
                expected,
                found: format!("`{text}`"),
            });
        }
        if waited > self.config.open_limit {
            let command = match opening.step {
                Step::Banner => "soft reset",
                Step::Settling { .. } | Step::Build => "$I",
                Step::Settings => "$$",
                Step::Report => "?",
            };
            let waited_ms = waited.as_millis() as u64;
            return self.down(Fault::NoResponse { command: command.to_owned(), waited_ms });
        }
        if opening.step == Step::Banner && now - opening.reset_at > GRBL_RESET_PERIOD {
            opening.reset_at = now;
            self.outgoing.push(RESET);
        }
        if opening.step == Step::Build
            && self.pending.front().is_some_and(|pending| now - pending.sent_at > GRBL_RESET_PERIOD)
        {
            // The banner was an earlier one: since then there was an alarm that requires a reset.
            self.pending.clear();
            (opening.step, opening.reset_at) = (Step::Banner, now);
            self.outgoing.push(RESET);
        }
        if let Step::Settling { banner_at } = opening.step
            && now - banner_at > GRBL_BANNER_SETTLING
        {
            opening.step = Step::Build;
            self.description = Description::default();
            self.send_line("$I".to_owned(), LineKind::Build, now, now + self.config.open_limit);
            return;
        }
        if opening.step == Step::Report && self.queries.last_sent_at.is_none_or(|at| now - at > GRBL_RESET_PERIOD)
        {
            self.outgoing.push(QUERY);
            self.queries.last_sent_at = Some(now);
        }
    }

    /// The lock after a start or a reset on the way also keeps the laser off. It is removed if no fault is reported:
    /// that moves nothing, and moves are refused here until the stage is homed.
    pub(super) fn unlock_if_no_fault(&mut self, state: MachineState, now: Instant) {
        let at_rest = self.activity == Activity::Rest && self.pending.is_empty() && !self.reset_awaited();
        if state == MachineState::Alarm
            && self.fault.is_none()
            && at_rest
            && !self.must_home
            && !self.is_quiet(now)
        {
            // The cause of the lock is unknown, and may have moved the stage.
            self.homed = false;
            self.send_line("$X".to_owned(), LineKind::Unlock, now, now + GRBL_ANSWER_LIMIT);
        }
    }
}
