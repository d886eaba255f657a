//! A motor that accelerates and brakes towards its target, integrated in small time steps.

use std::time::Instant;

use super::{EventLog, LogEvent};

/// Time steps are limited to this, s, so that a late thread causes no jump.
const LONGEST_STEP_S: f64 = 0.02;

/// A step of the integration, s.
const STEP_S: f64 = 0.000_5;

/// See the module. Positions are on the machine's scale, mm.
#[derive(Debug, Clone)]
pub struct SimulatedAxis {
    /// Position.
    pub at_mm: f64,
    /// Signed speed, mm/s.
    velocity_mm_s: f64,
    acceleration_mm_s2: f64,
    /// Target and speed limit.
    target: Option<(f64, f64)>,
    /// Whether it is blocked: it stays at its position for every command.
    pub stuck: bool,
    passed_at: Option<Instant>,
    event_log: EventLog,
    moving: bool,
}

impl SimulatedAxis {
    /// At rest.
    pub fn new(at_mm: f64, acceleration_mm_s2: f64, event_log: EventLog) -> Self {
        Self {
            at_mm,
            velocity_mm_s: 0.0,
            acceleration_mm_s2,
            target: None,
            stuck: false,
            passed_at: None,
            event_log,
            moving: false,
        }
    }

    /// Moves to `target_mm`, from any initial speed.
    pub fn go(&mut self, target_mm: f64, speed_mm_s: f64, now: Instant) {
        self.passed_at.get_or_insert(now);
        self.target = Some((target_mm, speed_mm_s));
        self.record_motion(now);
    }

    /// Brakes.
    pub fn brake(&mut self, now: Instant) {
        if self.target.is_some() {
            let path_mm = self.velocity_mm_s.powi(2) / (2.0 * self.acceleration_mm_s2);
            let target_mm = self.at_mm + path_mm * self.velocity_mm_s.signum();
            self.target = Some((target_mm, self.velocity_mm_s.abs()));
            self.advance_time(now);
        }
    }

    /// Stops abruptly.
    pub fn halt(&mut self, now: Instant) {
        (self.target, self.velocity_mm_s, self.passed_at) = (None, 0.0, None);
        self.record_motion(now);
    }

    /// Whether it moves or is about to move.
    pub fn moving(&self) -> bool {
        self.target.is_some()
    }

    /// Advances the time.
    pub fn advance_time(&mut self, now: Instant) {
        let Some(before) = self.passed_at else { return };
        let mut left_s = now.saturating_duration_since(before).as_secs_f64().min(LONGEST_STEP_S);
        self.passed_at = Some(now);
        while left_s > 0.0 && self.target.is_some() && !self.stuck {
            let step_s = left_s.min(STEP_S);
            self.step(step_s);
            left_s -= step_s;
        }
        if self.target.is_none() {
            self.passed_at = None;
        }
        self.event_log.record_position(now, self.at_mm);
        self.record_motion(now);
    }

    fn step(&mut self, step_s: f64) {
        let Some((target_mm, speed_mm_s)) = self.target else { return };
        let left_mm = target_mm - self.at_mm;
        let target_mm_s =
            (2.0 * self.acceleration_mm_s2 * left_mm.abs()).sqrt().min(speed_mm_s) * left_mm.signum();
        let most_mm_s = self.acceleration_mm_s2 * step_s;
        self.velocity_mm_s += (target_mm_s - self.velocity_mm_s).clamp(-most_mm_s, most_mm_s);
        let path_mm = self.velocity_mm_s * step_s;
        if left_mm.abs() <= path_mm.abs().max(1e-6) && self.velocity_mm_s.abs() <= 2.5 * most_mm_s {
            (self.at_mm, self.velocity_mm_s, self.target) = (target_mm, 0.0, None);
        } else {
            self.at_mm += path_mm;
        }
    }

    fn record_motion(&mut self, now: Instant) {
        if self.moving != self.target.is_some() {
            self.moving = self.target.is_some();
            let what =
                if self.moving { LogEvent::MotionBegan(self.at_mm) } else { LogEvent::MotionEnded(self.at_mm) };
            self.event_log.record(now, what);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_axis_reaches_its_target_and_brakes_with_its_acceleration() {
        let (event_log, mut now) = (EventLog::new(None).unwrap(), Instant::now());
        let mut axis = SimulatedAxis::new(0.0, 1000.0, event_log.clone());
        axis.go(5.0, 20.0, now);
        let begun_at = now;
        while axis.moving() {
            now += Duration::from_millis(1);
            axis.advance_time(now);
            assert!(now - begun_at < Duration::from_secs(1), "the target is not reached: {axis:?}");
        }
        // 5 mm at 20 mm/s with two ramps of 20 ms.
        let took_s = (now - begun_at).as_secs_f64();
        assert!((took_s - 0.27).abs() < 0.02 && axis.at_mm == 5.0, "{took_s} s, at {} mm", axis.at_mm);
        axis.go(0.0, 20.0, now);
        for _ in 0..100 {
            now += Duration::from_millis(1);
            axis.advance_time(now);
        }
        let from_mm = axis.at_mm;
        axis.brake(now);
        for _ in 0..60 {
            now += Duration::from_millis(1);
            axis.advance_time(now);
        }
        // v²/2a.
        assert!(!axis.moving() && (from_mm - axis.at_mm - 0.2).abs() < 0.05, "{} mm", from_mm - axis.at_mm);
        assert_eq!(event_log.n_motions_since(0), 2);
    }
}
