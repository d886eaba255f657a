//! A motor that accelerates and brakes towards its goal, integrated in small time steps.

use std::time::Instant;

use super::{Witness, WitnessEvent};

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
    /// Goal and speed limit.
    goal: Option<(f64, f64)>,
    /// Whether it is blocked: it stays at its position, whatever the command.
    pub stuck: bool,
    passed_at: Option<Instant>,
    witness: Witness,
    moving: bool,
}

impl SimulatedAxis {
    /// At rest.
    pub fn new(at_mm: f64, acceleration_mm_s2: f64, witness: Witness) -> Self {
        Self {
            at_mm,
            velocity_mm_s: 0.0,
            acceleration_mm_s2,
            goal: None,
            stuck: false,
            passed_at: None,
            witness,
            moving: false,
        }
    }

    /// Moves to `goal_mm`, from any initial speed.
    pub fn go(&mut self, goal_mm: f64, speed_mm_s: f64, now: Instant) {
        self.passed_at.get_or_insert(now);
        self.goal = Some((goal_mm, speed_mm_s));
        self.record_motion(now);
    }

    /// Brakes.
    pub fn brake(&mut self, now: Instant) {
        if self.goal.is_some() {
            let way_mm = self.velocity_mm_s.powi(2) / (2.0 * self.acceleration_mm_s2);
            let goal_mm = self.at_mm + way_mm * self.velocity_mm_s.signum();
            self.goal = Some((goal_mm, self.velocity_mm_s.abs()));
            self.pass(now);
        }
    }

    /// Stops abruptly.
    pub fn halt(&mut self, now: Instant) {
        (self.goal, self.velocity_mm_s, self.passed_at) = (None, 0.0, None);
        self.record_motion(now);
    }

    /// Whether it moves or is about to move.
    pub fn moving(&self) -> bool {
        self.goal.is_some()
    }

    /// Advances the time.
    pub fn pass(&mut self, now: Instant) {
        let Some(before) = self.passed_at else { return };
        let mut left_s = now.saturating_duration_since(before).as_secs_f64().min(LONGEST_STEP_S);
        self.passed_at = Some(now);
        while left_s > 0.0 && self.goal.is_some() && !self.stuck {
            let step_s = left_s.min(STEP_S);
            self.step(step_s);
            left_s -= step_s;
        }
        if self.goal.is_none() {
            self.passed_at = None;
        }
        self.witness.saw_axis_at(now, self.at_mm);
        self.record_motion(now);
    }

    fn step(&mut self, step_s: f64) {
        let Some((goal_mm, speed_mm_s)) = self.goal else { return };
        let left_mm = goal_mm - self.at_mm;
        let wanted_mm_s =
            (2.0 * self.acceleration_mm_s2 * left_mm.abs()).sqrt().min(speed_mm_s) * left_mm.signum();
        let most_mm_s = self.acceleration_mm_s2 * step_s;
        self.velocity_mm_s += (wanted_mm_s - self.velocity_mm_s).clamp(-most_mm_s, most_mm_s);
        let way_mm = self.velocity_mm_s * step_s;
        if left_mm.abs() <= way_mm.abs().max(1e-6) && self.velocity_mm_s.abs() <= 2.5 * most_mm_s {
            (self.at_mm, self.velocity_mm_s, self.goal) = (goal_mm, 0.0, None);
        } else {
            self.at_mm += way_mm;
        }
    }

    fn record_motion(&mut self, now: Instant) {
        if self.moving != self.goal.is_some() {
            self.moving = self.goal.is_some();
            let what = if self.moving {
                WitnessEvent::MotionBegan(self.at_mm)
            } else {
                WitnessEvent::MotionEnded(self.at_mm)
            };
            self.witness.saw(now, what);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn it_goes_to_its_goal_and_brakes_by_its_acceleration() {
        let (witness, mut now) = (Witness::new(None).unwrap(), Instant::now());
        let mut axis = SimulatedAxis::new(0.0, 1000.0, witness.clone());
        axis.go(5.0, 20.0, now);
        let begun_at = now;
        while axis.moving() {
            now += Duration::from_millis(1);
            axis.pass(now);
            assert!(now - begun_at < Duration::from_secs(1), "it does not arrive: {axis:?}");
        }
        // 5 mm at 20 mm/s with two ramps of 20 ms.
        let took_s = (now - begun_at).as_secs_f64();
        assert!((took_s - 0.27).abs() < 0.02 && axis.at_mm == 5.0, "{took_s} s, at {} mm", axis.at_mm);
        axis.go(0.0, 20.0, now);
        for _ in 0..100 {
            now += Duration::from_millis(1);
            axis.pass(now);
        }
        let from_mm = axis.at_mm;
        axis.brake(now);
        for _ in 0..60 {
            now += Duration::from_millis(1);
            axis.pass(now);
        }
        // v²/2a.
        assert!(!axis.moving() && (from_mm - axis.at_mm - 0.2).abs() < 0.05, "{} mm", from_mm - axis.at_mm);
        assert_eq!(witness.n_motions_since(0), 2);
    }
}
