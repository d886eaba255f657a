//! Latency of frame processing: a histogram of fixed size.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Bins per doubling of a latency: steps of 4.4 %.
const CLASSES_PER_DOUBLING: f64 = 16.0;
/// Number of bins: from 1 µs to over a minute.
const CLASSES: usize = 16 * 26;

/// Latencies of the frames of a scan.
#[derive(Debug, Clone, Default)]
pub struct Timing {
    first_arrived_at: Option<Instant>,
    last_kept_at: Option<Instant>,
    to_profile: Delays,
    to_file: Delays,
}

impl Timing {
    /// Records when a frame arrived and when its profile was shown.
    pub fn shown(&mut self, arrived_at: Instant, shown_at: Instant) {
        self.first_arrived_at.get_or_insert(arrived_at);
        self.to_profile.add(shown_at.saturating_duration_since(arrived_at));
    }

    /// Records that a frame that arrived at the given time is now written to the operating system.
    pub fn kept(&mut self, arrived_at: Instant) {
        let now = Instant::now();
        self.last_kept_at = Some(now);
        self.to_file.add(now.saturating_duration_since(arrived_at));
    }

    /// For the scan report; `None` without frames. Rates are from the first arrival to the last frame in the file.
    pub fn to_json(&self) -> Option<Value> {
        let took = self.last_kept_at?.saturating_duration_since(self.first_arrived_at?);
        Some(json!({
            "frames_per_s": self.to_file.n as f64 / took.as_secs_f64().max(1e-9),
            "arrival_to_profile_ms": self.to_profile.to_json(),
            "arrival_to_file_ms": self.to_file.to_json(),
        }))
    }
}

/// Latency histogram.
#[derive(Debug, Clone)]
struct Delays {
    n: u64,
    longest: Duration,
    by_class: Box<[u32; CLASSES]>,
}

impl Default for Delays {
    fn default() -> Self {
        Self { n: 0, longest: Duration::ZERO, by_class: Box::new([0; CLASSES]) }
    }
}

impl Delays {
    fn add(&mut self, delay: Duration) {
        let class = CLASSES_PER_DOUBLING * (delay.as_secs_f64() * 1e6).max(1.0).log2();
        self.by_class[(class as usize).min(CLASSES - 1)] += 1;
        self.n += 1;
        self.longest = self.longest.max(delay);
    }

    /// The latency quantile, ms: the upper edge of its bin.
    fn quantile_ms(&self, share: f64) -> f64 {
        let wanted = (self.n as f64 * share).ceil() as u64;
        let mut seen = 0;
        let class = self.by_class.iter().position(|n| {
            seen += u64::from(*n);
            seen >= wanted
        });
        let upper_us = ((class.unwrap_or(0) + 1) as f64 / CLASSES_PER_DOUBLING).exp2();
        (upper_us / 1e3).min(self.longest.as_secs_f64() * 1e3)
    }

    fn to_json(&self) -> Value {
        json!({
            "p50": self.quantile_ms(0.5),
            "p99": self.quantile_ms(0.99),
            "max": self.longest.as_secs_f64() * 1e3,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_within_one_bin_of_the_true_ones() {
        let mut delays = Delays::default();
        (1..=1000).for_each(|ms| delays.add(Duration::from_millis(ms)));
        let class = 2f64.powf(1.0 / CLASSES_PER_DOUBLING);
        for (share, true_ms) in [(0.5, 500.0), (0.99, 990.0)] {
            let quantile_ms = delays.quantile_ms(share);
            assert!(
                (true_ms..=true_ms * class).contains(&quantile_ms),
                "{quantile_ms} ms instead of {true_ms} ms"
            );
        }
        assert_eq!(delays.quantile_ms(1.0), 1000.0);
    }

    #[test]
    fn a_recording_without_frames_has_no_timing() {
        assert_eq!(Timing::default().to_json(), None);
    }
}
