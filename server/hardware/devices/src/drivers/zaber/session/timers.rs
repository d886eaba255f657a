//! Timed events: queries, silence, the limit of homing.

use std::time::{Duration, Instant};

use super::{Activity, CommandKind, Link, Session};
use crate::StageError;
use crate::params::{
    ZABER_BRAKING_QUERY, ZABER_IDENTITY_PERIOD, ZABER_IDLE_QUERY_HZ, ZABER_QUERY_AGAIN, ZABER_SILENCE,
};

impl Session {
    /// Processes what is due at `now`.
    pub(super) fn pass(&mut self, now: Instant) {
        match self.link {
            Link::Down => return,
            Link::Opening(_) => return self.opening_tick(now),
            Link::Up => {}
        }
        if let Some(fault) = self.silence(now) {
            return self.down(fault);
        }
        if let Activity::Homing { begun_at, .. } = self.activity
            && now - begun_at > self.config.homing_limit
        {
            let waited_ms = (now - begun_at).as_millis() as u64;
            self.raise(StageError::NoResponse { command: "home".to_owned(), waited_ms }, now);
        }
        self.pending.retain(|pending| {
            let lost = now - pending.sent_at > ZABER_QUERY_AGAIN;
            !(lost && matches!(pending.what, CommandKind::Position | CommandKind::Serial))
        });
        self.query_if_due(now);
    }

    fn query_if_due(&mut self, now: Instant) {
        let period = match self.activity {
            Activity::Stopping { .. } => ZABER_BRAKING_QUERY,
            Activity::Rest | Activity::Held(_) if self.seen.as_ref().is_some_and(|seen| !seen.busy) => {
                Duration::from_secs_f64(1.0 / ZABER_IDLE_QUERY_HZ)
            }
            _ => Duration::from_secs_f64(1.0 / self.config.moving_query_hz),
        };
        let asked = |what: CommandKind| self.pending.iter().any(|pending| pending.what == what);
        let is_due = |at: Option<Instant>, period| at.is_none_or(|at| now - at >= period);
        if !asked(CommandKind::Position) && is_due(self.position_queried_at, period) {
            self.query_position(now);
        }
        let asked = |what: CommandKind| self.pending.iter().any(|pending| pending.what == what);
        if !asked(CommandKind::Serial) && is_due(self.serial_queried_at, ZABER_IDENTITY_PERIOD) {
            self.serial_queried_at = Some(now);
            self.send(0, "get system.serial", CommandKind::Serial, now);
        }
    }

    pub(super) fn query_position(&mut self, now: Instant) {
        self.position_queried_at = Some(now);
        self.send(self.config.axis, "get pos", CommandKind::Position, now);
    }

    /// A command that was not answered, or silence.
    fn silence(&self, now: Instant) -> Option<StageError> {
        let matters = |what: CommandKind| !matches!(what, CommandKind::Position | CommandKind::Serial);
        let unanswered = self.pending.iter().find(|pending| {
            matters(pending.what) && now.saturating_duration_since(pending.sent_at) > ZABER_SILENCE
        });
        let (command, since) = match (unanswered, self.received_at) {
            (Some(pending), _) => (pending.text.clone(), pending.sent_at),
            (None, Some(received_at)) if now.saturating_duration_since(received_at) > ZABER_SILENCE => {
                ("get pos".to_owned(), received_at)
            }
            _ => return None,
        };
        let waited_ms = (now - since).as_millis() as u64;
        Some(self.foreign_lines.unanswered(&command, waited_ms))
    }
}
