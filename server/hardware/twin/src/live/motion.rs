//! Motion profile of the carriage: consecutive phases of constant acceleration.

use std::time::{Duration, Instant};

/// A phase of constant acceleration.
#[derive(Debug, Clone, Copy)]
struct Phase {
    duration_s: f64,
    from_mm: f64,
    speed_mm_s: f64,
    acceleration_mm_s2: f64,
}

/// A motion from its start to rest.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    began: Instant,
    phases: Vec<Phase>,
    from_mm: f64,
    to_mm: f64,
    ramped: bool,
}

/// Position and speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotionState {
    pub position_mm: f64,
    pub speed_mm_s: f64,
}

impl Phase {
    fn at(&self, time_s: f64) -> MotionState {
        MotionState {
            position_mm: self.from_mm + time_s * (self.speed_mm_s + time_s * self.acceleration_mm_s2 / 2.0),
            speed_mm_s: self.speed_mm_s + time_s * self.acceleration_mm_s2,
        }
    }
}

impl Motion {
    /// At rest.
    pub(super) fn rest(at: Instant, position_mm: f64) -> Self {
        Self { began: at, phases: Vec::new(), from_mm: position_mm, to_mm: position_mm, ramped: false }
    }

    /// From rest to rest with ramps; without `acceleration_mm_s2` there are no ramps.
    pub(super) fn travel(
        began: Instant,
        (from_mm, to_mm): (f64, f64),
        speed_mm_s: f64,
        acceleration_mm_s2: Option<f64>,
    ) -> Self {
        let (distance, sign) = ((to_mm - from_mm).abs(), (to_mm - from_mm).signum());
        let Some(acceleration) = acceleration_mm_s2 else {
            let phase = Phase {
                duration_s: distance / speed_mm_s,
                from_mm,
                speed_mm_s: sign * speed_mm_s,
                acceleration_mm_s2: 0.0,
            };
            return Self { began, phases: vec![phase], from_mm, to_mm, ramped: false };
        };
        let peak = speed_mm_s.min((distance * acceleration).sqrt());
        let (ramp_s, ramp_mm) = (peak / acceleration, peak * peak / (2.0 * acceleration));
        let even_s = if peak > 0.0 { (distance - 2.0 * ramp_mm).max(0.0) / peak } else { 0.0 };
        let phase = |duration_s, from: f64, speed: f64, change: f64| Phase {
            duration_s,
            from_mm: from_mm + sign * from,
            speed_mm_s: sign * speed,
            acceleration_mm_s2: sign * change,
        };
        let phases = vec![
            phase(ramp_s, 0.0, 0.0, acceleration),
            phase(even_s, ramp_mm, peak, 0.0),
            phase(ramp_s, distance - ramp_mm, peak, -acceleration),
        ];
        Self { began, phases, from_mm, to_mm, ramped: true }
    }

    /// This motion, followed by a travel to another position.
    pub(super) fn then(mut self, to_mm: f64, speed_mm_s: f64, acceleration_mm_s2: Option<f64>) -> Self {
        let next = Self::travel(self.began, (self.to_mm, to_mm), speed_mm_s, acceleration_mm_s2);
        self.phases.extend(next.phases);
        self.to_mm = to_mm;
        self
    }

    /// Brakes to rest from the state at `at`, as fast as the ramp allows.
    pub(super) fn braked(&self, at: Instant, acceleration_mm_s2: Option<f64>) -> Self {
        let state = self.state_at(at);
        let Some(acceleration) = acceleration_mm_s2.filter(|_| state.speed_mm_s != 0.0) else {
            return Self::rest(at, state.position_mm);
        };
        let phase = Phase {
            duration_s: state.speed_mm_s.abs() / acceleration,
            from_mm: state.position_mm,
            speed_mm_s: state.speed_mm_s,
            acceleration_mm_s2: -acceleration * state.speed_mm_s.signum(),
        };
        let to_mm = phase.at(phase.duration_s).position_mm;
        Self { began: at, phases: vec![phase], from_mm: state.position_mm, to_mm, ramped: true }
    }

    /// Position and speed at `at`; before the start those of the start, after the end at rest.
    pub(super) fn state_at(&self, at: Instant) -> MotionState {
        let mut time_s = at.saturating_duration_since(self.began).as_secs_f64();
        for phase in &self.phases {
            if time_s < phase.duration_s {
                return phase.at(time_s);
            }
            time_s -= phase.duration_s;
        }
        MotionState { position_mm: self.to_mm, speed_mm_s: 0.0 }
    }

    /// Start position.
    pub(super) fn begin_mm(&self) -> f64 {
        self.from_mm
    }

    /// Whether it ends with a ramp, so that the carriage rings afterwards.
    pub(super) fn ramped(&self) -> bool {
        self.ramped
    }

    /// Final position.
    pub(super) fn to_mm(&self) -> f64 {
        self.to_mm
    }

    /// Time at which it comes to rest.
    pub(super) fn end(&self) -> Instant {
        self.began + Duration::from_secs_f64(self.phases.iter().map(|phase| phase.duration_s).sum())
    }

    /// Whether it is still moving at `at`.
    pub(super) fn moving(&self, at: Instant) -> bool {
        at < self.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of nanoseconds at 100 mm/s.
    const ROUNDING_MM: f64 = 1e-6;

    fn at(motion: &Motion, time_s: f64) -> MotionState {
        motion.state_at(motion.began + Duration::from_secs_f64(time_s))
    }

    #[test]
    fn a_long_move_ramps_up_runs_evenly_and_ramps_down() {
        let motion = Motion::travel(Instant::now(), (10.0, -40.0), 100.0, Some(500.0));
        // 0.2 s and 10 mm per ramp, 30 mm at 100 mm/s.
        for (time_s, position_mm, speed_mm_s) in
            [(0.0, 10.0, 0.0), (0.1, 7.5, -50.0), (0.2, 0.0, -100.0), (0.35, -15.0, -100.0), (0.6, -37.5, -50.0)]
        {
            let state = at(&motion, time_s);
            assert!((state.position_mm - position_mm).abs() < ROUNDING_MM, "{time_s}: {state:?}");
            assert!((state.speed_mm_s - speed_mm_s).abs() < 1e-5, "{time_s}: {state:?}");
        }
        assert_eq!(at(&motion, 0.71), MotionState { position_mm: -40.0, speed_mm_s: 0.0 });
    }

    #[test]
    fn a_short_move_never_reaches_its_speed() {
        let motion = Motion::travel(Instant::now(), (0.0, 5.0), 100.0, Some(500.0));
        assert!((at(&motion, 0.1).speed_mm_s - 50.0).abs() < 1e-5);
        assert!((at(&motion, 0.1).position_mm - 2.5).abs() < ROUNDING_MM);
        assert_eq!(motion.end() - motion.began, Duration::from_millis(200));
    }

    #[test]
    fn braking_starts_at_the_speed_it_has() {
        let motion = Motion::travel(Instant::now(), (0.0, 50.0), 100.0, Some(500.0));
        let braked = motion.braked(motion.began + Duration::from_millis(300), Some(500.0));
        assert!((braked.to_mm() - 30.0).abs() < ROUNDING_MM);
        assert!((at(&braked, 0.0).speed_mm_s - 100.0).abs() < 1e-9);
        let at_once = motion.braked(motion.began + Duration::from_millis(300), None);
        assert!((at_once.to_mm() - 20.0).abs() < ROUNDING_MM && !at_once.moving(at_once.began));
    }
}
