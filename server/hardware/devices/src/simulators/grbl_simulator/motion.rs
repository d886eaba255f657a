//! One axis in real time: trapezoidal moves, braking, and the position at an instant.

use std::time::{Duration, Instant};

/// A move with constant acceleration, constant speed and constant braking, mm and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    from_mm: f64,
    /// +1 or −1.
    direction: f64,
    /// Initial speed; above 0 only while braking from a move.
    initial_mm_s: f64,
    peak_mm_s: f64,
    acceleration_mm_s2: f64,
    cruise_s: f64,
    begun_at: Instant,
}

impl Motion {
    /// From rest at `from_mm` to rest at `to_mm`.
    pub fn travel(from_mm: f64, to_mm: f64, speed_mm_s: f64, acceleration_mm_s2: f64, begun_at: Instant) -> Self {
        let distance_mm = (to_mm - from_mm).abs();
        let peak_mm_s = speed_mm_s.min((distance_mm * acceleration_mm_s2).sqrt());
        let ramps_mm = peak_mm_s * peak_mm_s / acceleration_mm_s2;
        let cruise_s = if peak_mm_s > 0.0 { (distance_mm - ramps_mm).max(0.0) / peak_mm_s } else { 0.0 };
        let direction = if to_mm >= from_mm { 1.0 } else { -1.0 };
        Self { from_mm, direction, initial_mm_s: 0.0, peak_mm_s, acceleration_mm_s2, cruise_s, begun_at }
    }

    /// Braking from position and speed of `self` at `now`.
    pub fn braking(&self, now: Instant) -> Self {
        let (at_mm, speed_mm_s) = self.at(now);
        Self {
            from_mm: at_mm,
            initial_mm_s: speed_mm_s,
            peak_mm_s: speed_mm_s,
            cruise_s: 0.0,
            begun_at: now,
            ..*self
        }
    }

    /// When it comes to rest.
    pub fn ends_at(&self) -> Instant {
        self.begun_at
            + Duration::from_secs_f64(self.ramp_up_s() + self.cruise_s + self.peak_mm_s / self.acceleration_mm_s2)
    }

    /// Position, mm, and speed, mm/s, at `now`.
    pub fn at(&self, now: Instant) -> (f64, f64) {
        let t_s = now.saturating_duration_since(self.begun_at).as_secs_f64();
        let a = self.acceleration_mm_s2;
        let (up_s, down_s) = (self.ramp_up_s(), self.peak_mm_s / a);
        let rising_s = t_s.min(up_s);
        let cruising_s = (t_s - up_s).clamp(0.0, self.cruise_s);
        let falling_s = (t_s - up_s - self.cruise_s).clamp(0.0, down_s);
        let path_mm = (self.initial_mm_s + 0.5 * a * rising_s) * rising_s
            + self.peak_mm_s * cruising_s
            + (self.peak_mm_s - 0.5 * a * falling_s) * falling_s;
        let speed_mm_s =
            if t_s < up_s { self.initial_mm_s + a * t_s } else { (self.peak_mm_s - a * falling_s).max(0.0) };
        (self.from_mm + self.direction * path_mm, speed_mm_s)
    }

    fn ramp_up_s(&self) -> f64 {
        (self.peak_mm_s - self.initial_mm_s) / self.acceleration_mm_s2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_ends_at_its_target_and_never_exceeds_its_speed() {
        let begun_at = Instant::now();
        // Long enough to cruise, and too short for it, in both directions.
        for (from_mm, to_mm) in [(-3.0, 17.0), (5.0, 4.9), (2.0, 2.0)] {
            let motion = Motion::travel(from_mm, to_mm, 40.0, 800.0, begun_at);
            assert!((motion.at(motion.ends_at()).0 - to_mm).abs() < 1e-6);
            for t_ms in 0..600 {
                assert!(motion.at(begun_at + Duration::from_millis(t_ms)).1 <= 40.0 + 1e-9);
            }
        }
    }

    #[test]
    fn braking_is_smooth_and_takes_speed_squared_over_twice_the_acceleration() {
        let begun_at = Instant::now();
        let motion = Motion::travel(0.0, 100.0, 40.0, 800.0, begun_at);
        let now = begun_at + Duration::from_millis(500);
        let braking = motion.braking(now);
        assert_eq!(braking.at(now), motion.at(now));
        let path_mm = braking.at(braking.ends_at()).0 - motion.at(now).0;
        assert!((path_mm - 40.0 * 40.0 / 1600.0).abs() < 1e-6, "braked over {path_mm} mm");
    }
}
