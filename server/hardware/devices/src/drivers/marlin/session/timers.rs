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
        self.send_again(now);
        if self.lit.is_some_and(|lit| now >= lit.until) && self.dark_by.is_none() {
            tracing::warn!(place = self.place, "the laser's lease ended without its owner");
            self.turn_laser_off(now);
        }
        if self.dark_by.is_some_and(|by| now >= by) {
            return self.halt("its laser did not go off, so that it was halted (M112)");
        }
        if let Activity::Stopping(stopping) = self.activity
            && now >= stopping.until
        {
            self.end_late_stop(stopping, now);
        }
        if let Activity::Homing { begun_at, .. } = self.activity
            && now - begun_at > self.config.homing_limit
        {
            return self.halt("homing took too long, so that it was halted (M112)");
        }
        if let Some(fault) = self.silence(now) {
            self.down(fault);
        }
    }

    /// The pieces sent have not run out in time: the quick stop drops them, and the position with them.
    fn end_late_stop(&mut self, stopping: Stopping, now: Instant) {
        if stopping.cut_short {
            return self.halt("it did not stop, so that it was halted (M112)");
        }
        tracing::warn!(place = self.place, "a stop did not run out in time: quick stop (M410), position unknown");
        self.outgoing.extend_from_slice(b"\nM410\n");
        self.homed = false;
        if let Some(pending) = &mut self.pending {
            pending.answer_by = now + MARLIN_QUICK_STOP;
        }
        let until = now + MARLIN_QUICK_STOP;
        self.activity = Activity::Stopping(Stopping { until, then: None, cut_short: true, ..stopping });
    }

    fn send_again(&mut self, now: Instant) {
        let Some(pending) = self.pending.as_mut().filter(|pending| pending.again_at.is_some_and(|at| now >= at))
        else {
            return;
        };
        pending.again_at = None;
        pending.sent_at = now;
        let line = numbered(pending.number, &pending.wanted.text);
        self.outgoing.extend_from_slice(line.as_bytes());
    }

    fn silence(&self, now: Instant) -> Option<StageError> {
        let pending = self.pending.as_ref().filter(|pending| now > pending.answer_by)?;
        let waited_ms = now.saturating_duration_since(pending.sent_at).as_millis() as u64;
        Some(StageError::NoReply { command: pending.wanted.text.clone(), waited_ms })
    }

    /// The firmware is executing a line that takes time.
    pub(super) fn is_busy(&mut self, now: Instant) {
        let limit =
            crate::params::MARLIN_SILENCE + std::time::Duration::from_secs(crate::params::MARLIN_KEEPALIVE_S);
        // Lines that wait for a motion of this driver have a limit of their own.
        if let Some(pending) = self.pending.as_mut().filter(|pending| pending.wanted.kind == LineKind::Home) {
            pending.answer_by = now + limit;
        }
    }
}
