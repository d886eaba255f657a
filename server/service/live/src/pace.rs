//! Rate limiting with even spacing.

use tokio::time::{Duration, Instant};

/// A rate limiter: an item may be early by up to half a period, so that a jittering source of the same rate loses nothing,
/// but the average rate is never exceeded.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    period: Duration,
    due: Instant,
}

impl Pace {
    /// From `now` on, `rate_hz` (above 0) times per second.
    pub fn new(rate_hz: f64, now: Instant) -> Self {
        let mut pace = Self { period: Duration::ZERO, due: now };
        pace.set_rate(rate_hz);
        pace
    }

    /// Changes the rate.
    pub fn set_rate(&mut self, rate_hz: f64) {
        self.period = Duration::from_secs_f64((1.0 / rate_hz).min(LONGEST_PERIOD.as_secs_f64()));
    }

    /// When the next item may pass.
    pub fn opens(&self) -> Instant {
        self.due.checked_sub(self.period / 2).unwrap_or(self.due)
    }

    /// Records that an item passes now.
    pub fn pass(&mut self, now: Instant) {
        self.due = self.due.max(now) + self.period;
    }
}

/// Minimum rate: one per hour.
const LONGEST_PERIOD: Duration = Duration::from_secs(3600);

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of the events at `at_ms` pass.
    fn passed(rate_hz: f64, at_ms: impl Iterator<Item = u64>) -> usize {
        let start = Instant::now();
        let mut pace = Pace::new(rate_hz, start);
        at_ms
            .map(|ms| start + Duration::from_millis(ms))
            .filter(|now| {
                let open = *now >= pace.opens();
                if open {
                    pace.pass(*now);
                }
                open
            })
            .count()
    }

    #[test]
    fn a_jittering_source_of_the_same_rate_passes_whole() {
        let jitter = [0, 12, 5, 16, 3, 9];
        assert_eq!(passed(25.0, (0..100u64).map(|idx| idx * 40 + jitter[idx as usize % 6])), 100);
    }

    #[test]
    fn a_fast_source_is_held_to_the_rate() {
        // 10 s at 20 Hz, and one early at the start.
        assert!((200..=201).contains(&passed(20.0, 0..10_000)));
    }
}
