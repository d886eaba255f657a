//! Timed events: silence, resent lines, the lease, the ends of stops and of homing.

use std::time::Instant;

use super::{Activity, LineKind, Link, Session, Stopping};
use crate::StageError;
use crate::drivers::marlin::protocol::numbered;
use crate::params::MARLIN_QUICK_STOP;

impl Session {
    /// Processes what is due at `now`.
    pub(super) fn pass(&mut self, now: Instant) {
        match self.link {
            Link::Down => return,
            Link::Opening(_) => return self.opening_tick(now),
            Link::Up => {}
        }
        self.resend_if_due(now);
        if self.laser_lease.is_some_and(|laser_lease| now >= laser_lease.until)
            && self.laser_off_deadline.is_none()
        {
            tracing::warn!(port_name = self.port_name, "the laser's lease expired without a renewal");
            self.turn_laser_off(now);
        }
        if self.laser_off_deadline.is_some_and(|by| now >= by) {
            return self.halt("the laser did not turn off, so the controller was halted (M112)");
        }
        if let Activity::Stopping(stopping) = self.activity
            && now >= stopping.until
        {
            self.end_late_stop(stopping, now);
        }
        if let Activity::Homing { begun_at, .. } = self.activity
            && now - begun_at > self.config.homing_limit
        {
            return self.halt("homing took too long, so the controller was halted (M112)");
        }
        if let Some(fault) = self.silence(now) {
            self.down(fault);
        }
    }

    /// The pieces sent have not run out in time: the quick stop drops them, and the position with them.
    fn end_late_stop(&mut self, stopping: Stopping, now: Instant) {
        if stopping.is_quick_stop {
            return self.halt("it did not stop, so the controller was halted (M112)");
        }
        tracing::warn!(
            port_name = self.port_name,
            "a stop did not run out in time: quick stop (M410), position unknown"
        );
        self.outgoing.extend_from_slice(b"\nM410\n");
        self.homed = false;
        if let Some(pending) = &mut self.pending {
            pending.answer_by = now + MARLIN_QUICK_STOP;
        }
        let until = now + MARLIN_QUICK_STOP;
        self.activity = Activity::Stopping(Stopping { until, then: None, is_quick_stop: true, ..stopping });
    }

    fn resend_if_due(&mut self, now: Instant) {
        let Some(pending) = self.pending.as_mut().filter(|pending| pending.resend_at.is_some_and(|at| now >= at))
        else {
            return;
        };
        pending.resend_at = None;
        pending.sent_at = now;
        let line = numbered(pending.number, &pending.queued.text);
        self.outgoing.extend_from_slice(line.as_bytes());
    }

    fn silence(&self, now: Instant) -> Option<StageError> {
        let pending = self.pending.as_ref().filter(|pending| now > pending.answer_by)?;
        let waited_ms = now.saturating_duration_since(pending.sent_at).as_millis() as u64;
        Some(self.foreign_lines.unanswered(&pending.queued.text, waited_ms))
    }

    /// The firmware is executing a line that takes time.
    pub(super) fn is_busy(&mut self, now: Instant) {
        let limit =
            crate::params::MARLIN_SILENCE + std::time::Duration::from_secs(crate::params::MARLIN_KEEPALIVE_S);
        // Lines that wait for a motion of this driver have a limit of their own.
        if let Some(pending) = self.pending.as_mut().filter(|pending| pending.queued.kind == LineKind::Home) {
            pending.answer_by = now + limit;
        }
    }
}
