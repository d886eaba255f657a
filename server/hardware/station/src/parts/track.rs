//! Recent stage positions, with interpolation.

use std::collections::VecDeque;
use std::time::Instant;

use crate::params::TRACK_READINGS;

/// Readings in order of time.
#[derive(Debug, Default)]
pub struct Track {
    readings: VecDeque<(Instant, f64)>,
}

impl Track {
    /// Adds a reading; one that is not newer than the last is a duplicate.
    pub fn push(&mut self, at: Instant, position_mm: f64) {
        if self.readings.back().is_some_and(|(newest, _)| *newest >= at) {
            return;
        }
        if self.readings.len() == TRACK_READINGS {
            self.readings.pop_front();
        }
        self.readings.push_back((at, position_mm));
    }

    /// Discards all readings: the position was lost.
    pub fn clear(&mut self) {
        self.readings.clear();
    }

    /// Whether there is a reading at or after `at`.
    pub fn reaches(&self, at: Instant) -> bool {
        self.readings.back().is_some_and(|(newest, _)| *newest >= at)
    }

    /// Position at `at`, interpolated linearly between the adjacent readings; `None` outside of them.
    pub fn position_mm(&self, at: Instant) -> Option<f64> {
        let after = self.readings.partition_point(|(time, _)| *time < at);
        let (later, later_mm) = self.readings.get(after)?;
        if *later == at {
            return Some(*later_mm);
        }
        let (earlier, earlier_mm) = self.readings.get(after.checked_sub(1)?)?;
        let fraction = (at - *earlier).as_secs_f64() / (*later - *earlier).as_secs_f64();
        Some(earlier_mm + fraction * (later_mm - earlier_mm))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn between_readings_the_position_lies_on_the_line() {
        let start = Instant::now();
        let mut track = Track::default();
        track.push(start, 10.0);
        track.push(start + Duration::from_millis(10), 12.0);
        let within = track.position_mm(start + Duration::from_micros(2500)).unwrap();
        assert!((within - 10.5).abs() < 1e-12, "{within}");
        assert_eq!(track.position_mm(start), Some(10.0));
        assert_eq!(track.position_mm(start + Duration::from_millis(11)), None);
    }

    #[test]
    fn a_year_of_readings_keeps_only_the_last_ones() {
        let start = Instant::now();
        let mut track = Track::default();
        for k in 0..10_000_u64 {
            track.push(start + Duration::from_millis(k), k as f64);
        }
        assert_eq!(track.readings.len(), TRACK_READINGS);
        assert_eq!(track.position_mm(start), None, "too old to be known");
    }
}
