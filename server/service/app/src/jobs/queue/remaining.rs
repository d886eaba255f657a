//! Estimated remaining time of a job, from its own progress.

use crate::jobs::queue::params::{GUESS_AFTER_FRACTION, GUESS_AFTER_S, GUESS_MEMORY_S};

/// A smoothed estimate.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::jobs) struct Remaining {
    /// The estimate, and when it was made, in seconds since the start.
    guess: Option<(f64, f64)>,
}

impl Remaining {
    /// Records that `fraction` was done `elapsed_s` after the start.
    pub fn learn(&mut self, fraction: f64, elapsed_s: f64) {
        if fraction < GUESS_AFTER_FRACTION || elapsed_s < GUESS_AFTER_S {
            return;
        }
        let fresh_s = elapsed_s * (1.0 - fraction) / fraction;
        let left_s = match self.guess {
            None => fresh_s,
            Some((_, at_s)) => {
                let kept = (-(elapsed_s - at_s).max(0.0) / GUESS_MEMORY_S).exp();
                let counted_down_s = self.left_s(elapsed_s).unwrap_or(fresh_s);
                kept * counted_down_s + (1.0 - kept) * fresh_s
            }
        };
        self.guess = Some((left_s, elapsed_s));
    }

    /// Seconds remaining, `elapsed_s` after the start; `None` while unknown.
    pub fn left_s(&self, elapsed_s: f64) -> Option<f64> {
        self.guess.map(|(left_s, at_s)| (left_s - (elapsed_s - at_s)).max(0.0))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_job_is_estimated_to_the_second_and_counts_down() {
        let mut remaining = Remaining::default();
        remaining.learn(0.01, 0.2);
        assert_eq!(remaining.left_s(0.2), None);
        for tenth in 1..=50 {
            remaining.learn(f64::from(tenth) / 200.0, f64::from(tenth) / 10.0);
        }
        // A quarter done after 5 s: 15 s left, a second later 14 s.
        assert!((remaining.left_s(5.0).unwrap() - 15.0).abs() < 1e-9);
        assert!((remaining.left_s(6.0).unwrap() - 14.0).abs() < 1e-9);
    }

    #[test]
    fn a_sudden_slowdown_changes_the_estimate_gradually() {
        let mut remaining = Remaining::default();
        remaining.learn(0.5, 5.0);
        remaining.learn(0.5, 5.5);
        let soon_s = remaining.left_s(5.5).unwrap();
        assert!((4.5..5.0).contains(&soon_s), "{soon_s}");
    }
}
