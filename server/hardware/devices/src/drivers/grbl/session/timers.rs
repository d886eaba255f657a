//! Timed events: queries, silence, the lease, the ends of braking and waiting.

use std::time::{Duration, Instant};

use super::{Activity, LineKind, Link, Pending, Session, Stopping};
use crate::drivers::grbl::fault::Fault;
use crate::drivers::grbl::protocol::{HOLD, MachineState, QUERY};
use crate::params::{
    GRBL_ANSWER_LIMIT, GRBL_BRAKING_QUERY, GRBL_IDLE_QUERY_HZ, GRBL_LASER_OFF_LIMIT, GRBL_LASER_ON_BRAKING,
    GRBL_LINE_LOST, GRBL_LINE_TIME, GRBL_SILENCE,
};

/// Longest sleep of the thread at rest with the laser off; its queries are slower.
const RESTING_WAIT: Duration = Duration::from_millis(40);

/// Longest sleep while something moves, the laser is on or an answer is awaited.
const BUSY_WAIT: Duration = Duration::from_millis(5);

/// Interval after which an unanswered query is repeated; GRBL ignores duplicates, so that they do not accumulate.
const QUERY_RETRY: Duration = Duration::from_millis(200);

impl Session {
    /// Processes what is due at `now`.
    pub fn tick(&mut self, now: Instant) {
        match self.link {
            Link::Down => {}
            Link::Opening(_) => self.opening_tick(now),
            Link::Up => {
                if self.incoming_since.is_some_and(|since| now - since > GRBL_LINE_TIME) {
                    self.discard_line(now);
                }
                self.reset_again(now);
                self.end_lease(now);
                self.end_braking(now);
                self.unlock_if_requested(now);
                self.check_timeouts(now);
            }
        }
        if matches!(self.link, Link::Up) {
            self.query_if_due(now);
        }
    }

    /// How long the thread may sleep before the next tick.
    pub fn wait(&self) -> Duration {
        let resting = matches!(self.link, Link::Up)
            && self.activity == Activity::Rest
            && self.laser_lease.is_none()
            && self.pending.is_empty()
            && !self.reset_awaited();
        if resting { RESTING_WAIT } else { BUSY_WAIT }
    }

    pub(super) fn query(&mut self, now: Instant) {
        self.outgoing.push(QUERY);
        self.queries.last_sent_at = Some(now);
        self.queries.unanswered_since.get_or_insert(now);
    }

    fn query_if_due(&mut self, now: Instant) {
        let period = match self.activity {
            Activity::Stopping(_) => GRBL_BRAKING_QUERY,
            Activity::Rest if !self.is_in_unrequested_motion() => {
                Duration::from_secs_f64(1.0 / GRBL_IDLE_QUERY_HZ)
            }
            Activity::Rest | Activity::Travel(_) | Activity::Homing { .. } => {
                Duration::from_secs_f64(1.0 / self.config.moving_query_hz)
            }
        };
        let period = if self.queries.unanswered_since.is_some() { period.max(QUERY_RETRY) } else { period };
        if !self.reset_awaited() && self.queries.last_sent_at.is_none_or(|at| now - at >= period) {
            self.query(now);
        }
    }

    /// Whether the last report shows a motion that is no longer requested.
    fn is_in_unrequested_motion(&self) -> bool {
        self.last_report
            .is_some_and(|last_report| !matches!(last_report.state, MachineState::Idle | MachineState::Alarm))
    }

    fn end_lease(&mut self, now: Instant) {
        if self.laser_lease.is_some_and(|laser_lease| now >= laser_lease.until)
            && self.laser_off_deadline.is_none()
        {
            tracing::warn!(port_name = self.port_name, "the laser's lease expired without a renewal");
            self.turn_laser_off(now);
        }
        if self.laser_off_deadline.is_some_and(|by| now >= by) && !self.reset_awaited() {
            self.laser_off_deadline = None;
            match self.activity {
                Activity::Rest | Activity::Homing { .. } => self.soft_reset(now),
                // A move has begun: it brakes first.
                Activity::Travel(_) => self.send_stop(HOLD, now),
                Activity::Stopping(_) => {}
            }
        }
    }

    /// After a limit alarm whose reset was not requested, or whose message was lost.
    fn reset_again(&mut self, now: Instant) {
        if self.reset_again_at.is_some_and(|at| now >= at) {
            self.reset_again_at = None;
            self.soft_reset(now);
        }
    }

    /// Whether the firmware is in the pause after an alarm.
    pub(super) fn is_quiet(&self, now: Instant) -> bool {
        self.quiet_until.is_some_and(|until| now < until)
    }

    /// `M5` where it works at once; while moving it would wait for the end of the move (`spindle_control.c`:
    /// `protocol_buffer_synchronize`), so that the move is stopped.
    pub(super) fn turn_laser_off(&mut self, now: Instant) {
        if self.laser_lease.is_none() || self.laser_off_deadline.is_some() || self.reset_awaited() {
            return;
        }
        match self.activity {
            Activity::Rest => {
                self.laser_off_deadline = Some(now + GRBL_LASER_OFF_LIMIT);
                self.send_line("M5".to_owned(), LineKind::LaserOff, now, now + 2 * GRBL_LASER_OFF_LIMIT);
            }
            Activity::Travel(_) | Activity::Homing { .. } => self.send_stop(HOLD, now),
            Activity::Stopping(stopping) => {
                let until = stopping.until.min(now + GRBL_LASER_ON_BRAKING);
                self.activity = Activity::Stopping(Stopping { until, only_jog: false, ..stopping });
            }
        }
    }

    fn end_braking(&mut self, now: Instant) {
        if let Activity::Stopping(stopping) = self.activity
            && now >= stopping.until
            && !self.reset_awaited()
        {
            self.soft_reset(now);
        }
    }

    /// Clears an acknowledged fault, and unlocks an alarm, once the associated reset is done.
    fn unlock_if_requested(&mut self, now: Instant) {
        if !self.clearing || self.reset_awaited() || self.is_quiet(now) || self.reset_again_at.is_some() {
            return;
        }
        if !matches!(self.fault, Some(Fault::Alarm { .. })) {
            (self.clearing, self.fault) = (false, None);
            return;
        }
        let unlocking = self.pending.iter().any(|pending| pending.kind == LineKind::Unlock);
        if !unlocking {
            self.send_line("$X".to_owned(), LineKind::Unlock, now, now + GRBL_ANSWER_LIMIT);
        }
    }

    fn check_timeouts(&mut self, now: Instant) {
        if matches!(self.fault, Some(Fault::Alarm { .. })) && self.reset_unanswered(now).is_some() {
            // It answers, or the next query decides, and no reset has effect: its emergency stop is pressed. The alarm
            // persists until the reset has effect.
            (self.reset, self.clearing) = (None, false);
            self.query(now);
        }
        let missed = self.reset_unanswered(now).or_else(|| self.line_unanswered(now)).or_else(|| self.silent(now));
        if let Some((command, since)) = missed {
            let waited_ms = (now - since).as_millis() as u64;
            self.down(match self.foreign_lines.damaged() {
                Some(received) => Fault::Unreadable { received: received.to_owned() },
                None => Fault::NoResponse { command, waited_ms },
            });
        }
    }

    fn reset_unanswered(&self, now: Instant) -> Option<(String, Instant)> {
        let reset = self.reset.filter(|reset| reset.awaited && now > reset.answer_by)?;
        Some(("soft reset".to_owned(), reset.sent_at))
    }

    fn line_unanswered(&self, now: Instant) -> Option<(String, Instant)> {
        let pending = self.pending.front().filter(|_| !self.reset_awaited())?;
        if now <= pending.answer_by && !self.is_lost(pending) {
            return None;
        }
        Some((pending.text.clone(), pending.sent_at))
    }

    /// Whether the line or its answer was lost: the firmware is at rest and does not accept a line that it would accept
    /// at once. `M3` and
    /// `M5` may wait for a spindle.
    fn is_lost(&self, pending: &Pending) -> bool {
        let at_once = matches!(pending.kind, LineKind::Travel | LineKind::Home | LineKind::Unlock);
        let rested =
            self.resting_since.zip(self.last_report).map(|(since, last_report)| last_report.queried_at - since);
        at_once && rested.is_some_and(|rested| rested > GRBL_LINE_LOST)
    }

    fn silent(&self, now: Instant) -> Option<(String, Instant)> {
        let answers_while_homing = self.machine.as_ref().is_some_and(|machine| machine.answers_while_homing);
        if self.reset_awaited() || (matches!(self.activity, Activity::Homing { .. }) && !answers_while_homing) {
            return None;
        }
        let queried_at = self.queries.unanswered_since?;
        let since = self.quiet_until.map_or(queried_at, |until| until.max(queried_at));
        let homing = matches!(self.activity, Activity::Homing { .. });
        let pause =
            self.machine.as_ref().filter(|_| homing).map_or(Duration::ZERO, |machine| machine.homing_pause);
        (now.saturating_duration_since(since) > GRBL_SILENCE + pause).then(|| ("?".to_owned(), queried_at))
    }
}
