//! Detects from the reported positions that a moving stage no longer advances.

use std::time::{Duration, Instant};

use crate::params::{STALL, STALL_REPORTS};

/// When a moving stage last advanced, and how many reports since showed it at the same place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    advanced_at: Instant,
    n_unchanged: usize,
}

impl Progress {
    /// The stage starts or continues its motion.
    pub fn begun(now: Instant) -> Self {
        Self { advanced_at: now, n_unchanged: 0 }
    }

    /// A report shows the stage further along, or at the same place as the one before.
    pub fn report(&mut self, has_advanced: bool, now: Instant) {
        if has_advanced {
            *self = Self::begun(now);
        } else {
            self.n_unchanged += 1;
        }
    }

    /// Whether the stage has stalled. Time alone does not show it: while this computer is suspended or overloaded, time
    /// passes without reports.
    pub fn has_stalled(&self, now: Instant) -> bool {
        self.n_unchanged >= STALL_REPORTS && self.elapsed(now) > STALL
    }

    fn elapsed(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.advanced_at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REPORT_PERIOD: Duration = Duration::from_millis(50);

    #[test]
    fn a_stage_at_one_place_has_stalled_after_the_stated_time() {
        let start = Instant::now();
        let mut progress = Progress::begun(start);
        let stalled_after = (1..100).find(|&idx| {
            let now = start + REPORT_PERIOD * idx;
            progress.report(false, now);
            progress.has_stalled(now)
        });
        assert_eq!(stalled_after, Some(11));
    }

    #[test]
    fn a_pause_of_the_computer_is_no_stall() {
        let start = Instant::now();
        let mut progress = Progress::begun(start);
        let after_pause = start + Duration::from_secs(20);
        progress.report(false, after_pause);
        assert!(!progress.has_stalled(after_pause));
        let next = after_pause + REPORT_PERIOD;
        progress.report(true, next);
        assert_eq!(progress, Progress::begun(next));
    }
}
