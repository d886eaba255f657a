//! Selection of the next line.

use std::time::{Duration, Instant};

use super::{Activity, LineKind, Link, Pending, QueuedLine, Session, Travel};
use crate::drivers::marlin::protocol::numbered;
use crate::params::{
    MARLIN_IDLE_QUERY_HZ, MARLIN_KEEPALIVE_S, MARLIN_LIGHT_KEEPALIVE, MARLIN_PIECE, MARLIN_SILENCE,
};

impl Session {
    /// Queues a line; returns its ticket.
    pub(super) fn enqueue(&mut self, text: String, kind: LineKind) -> u64 {
        self.next_ticket += 1;
        self.queued.push_back(QueuedLine { ticket: self.next_ticket, text, kind });
        self.next_ticket
    }

    /// Sends the next line, if none is pending.
    pub(super) fn send_next(&mut self, now: Instant) {
        if self.pending.is_some() || matches!(self.link, Link::Down) {
            return;
        }
        if let Some(queued) = self.queued.pop_front().or_else(|| self.chosen(now)) {
            self.last_number += 1;
            self.outgoing.extend_from_slice(numbered(self.last_number, &queued.text).as_bytes());
            let answer_by = now + self.answer_limit(queued.kind);
            let number = self.last_number;
            let (resend_at, n_resends, unknown) = (None, 0, false);
            self.pending =
                Some(Pending { queued, number, sent_at: now, answer_by, resend_at, n_resends, unknown });
        }
    }

    /// How long a line may take without a message from the firmware.
    fn answer_limit(&self, kind: LineKind) -> Duration {
        let speed_mm_s = self.machine.as_ref().map_or(0.0, |machine| match self.activity {
            Activity::Travel(travel) | Activity::Held(travel) => travel.speed_mm_s,
            _ => machine.capabilities.max_speed_mm_s.min(1e3),
        });
        match kind {
            LineKind::Settle | LineKind::LaserOn | LineKind::LaserOff => MARLIN_SILENCE + self.run_out(speed_mm_s),
            LineKind::Home => MARLIN_SILENCE + Duration::from_secs(MARLIN_KEEPALIVE_S),
            _ => MARLIN_SILENCE,
        }
    }

    /// The next line when none is queued: a position query, a piece of a move, a keep-alive of the laser.
    fn chosen(&mut self, now: Instant) -> Option<QueuedLine> {
        if !matches!(self.link, Link::Up) {
            return None;
        }
        let period_s = match self.activity {
            Activity::Rest | Activity::Held(_) => 1.0 / MARLIN_IDLE_QUERY_HZ,
            _ => 1.0 / self.config.moving_query_hz,
        };
        let due = self.position_queried_at.is_none_or(|at| now - at >= Duration::from_secs_f64(period_s));
        let resting = matches!(self.activity, Activity::Rest | Activity::Held(_));
        let (text, kind) = if due {
            self.position_queried_at = Some(now);
            ("M114".to_owned(), LineKind::Position)
        } else if let Some(text) = self.piece() {
            (text, LineKind::Piece)
        } else if resting
            && self.laser_lease.is_some()
            && self.light_kept_at.is_none_or(|at| now - at >= MARLIN_LIGHT_KEEPALIVE)
        {
            self.light_kept_at = Some(now);
            // Sets the timeout after which motors are switched off to never, and restarts the timeout of the laser.
            ("M84 S0".to_owned(), LineKind::LightKeepalive)
        } else {
            return None;
        };
        self.next_ticket += 1;
        Some(QueuedLine { ticket: self.next_ticket, text, kind })
    }

    /// The next piece of a move, while less than the look-ahead is pending.
    fn piece(&mut self) -> Option<String> {
        let Activity::Travel(travel) = self.activity else { return None };
        let at_steps = self.last_report?.steps;
        let per_mm = self.config.steps_per_mm;
        let ahead_steps = (self.ahead_mm(travel.speed_mm_s) * per_mm).round() as i64;
        let left_steps = travel.target_steps - travel.sent_steps;
        if left_steps == 0 || (travel.sent_steps - at_steps).abs() >= ahead_steps.max(1) {
            return None;
        }
        let piece_steps = ((travel.speed_mm_s * MARLIN_PIECE.as_secs_f64() * per_mm).round() as i64).max(1);
        // No tiny piece is left for the end.
        let sent_steps = if left_steps.abs() < 2 * piece_steps {
            travel.target_steps
        } else {
            travel.sent_steps + left_steps.signum() * piece_steps
        };
        self.activity = Activity::Travel(Travel { sent_steps, ..travel });
        let letter = self.config.axis.letter();
        Some(format!("G1 {letter}{:.4} F{:.1}", sent_steps as f64 / per_mm, travel.speed_mm_s * 60.0))
    }
}
