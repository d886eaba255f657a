//! When a delivery is tried again.

use std::time::Duration;

use crate::doors::params::{JITTER, LONGEST_RETRY_AFTER, UNREACHABLE_FIRST, UNREACHABLE_LAST};

/// Delay from the last of `n_failed` failed attempts to the next one; `None`: there is no further one. `retries` are the
/// delays since the first attempt.
pub fn retry_in(retries: &[Duration], n_failed: u32) -> Option<Duration> {
    let next = (n_failed as usize).checked_sub(1)?;
    let before = next.checked_sub(1).and_then(|last| retries.get(last).copied()).unwrap_or_default();
    retries.get(next).map(|at| at.saturating_sub(before))
}

/// Delay after `n_failed` attempts to reach a receiver, at least as long as it asked for.
pub fn reach_again_in(n_failed: u32, retry_after: Option<Duration>) -> Duration {
    let doubled = UNREACHABLE_FIRST.saturating_mul(1 << n_failed.saturating_sub(1).min(16));
    doubled.min(UNREACHABLE_LAST).max(retry_after.unwrap_or_default().min(LONGEST_RETRY_AFTER))
}

/// The delay, lengthened by a fraction of it that is random from event to event and the same in a repeated calculation.
pub fn jittered(delay: Duration, seed: u64) -> Duration {
    // The top bits of a multiplicative hash (Knuth, The Art of Computer Programming 6.4) are uniform.
    let share = (seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as f64 / f64::from(u32::MAX);
    delay.mul_f64(1.0 + JITTER * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doors::params::RETRIES;

    #[test]
    fn a_refused_event_is_tried_for_a_day() {
        let mut total = Duration::ZERO;
        for (n_failed, at) in (1..).zip(RETRIES) {
            total += retry_in(&RETRIES, n_failed).unwrap();
            assert_eq!(total, at);
        }
        assert_eq!(total, Duration::from_secs(24 * 3600));
        assert_eq!(retry_in(&RETRIES, 8), None);
        assert_eq!(retry_in(&RETRIES, u32::MAX), None);
    }

    #[test]
    fn an_unreachable_receiver_is_tried_at_least_every_half_minute_unless_it_asks_for_more() {
        let seconds: Vec<_> = (1..=7).map(|n| reach_again_in(n, None).as_secs()).collect();
        assert_eq!(seconds, [1, 2, 4, 8, 16, 30, 30]);
        assert_eq!(reach_again_in(u32::MAX, None), UNREACHABLE_LAST);
        assert_eq!(reach_again_in(1, Some(Duration::from_secs(120))), Duration::from_secs(120));
        assert_eq!(reach_again_in(1, Some(Duration::MAX)), LONGEST_RETRY_AFTER);
    }

    #[test]
    fn delays_differ_from_event_to_event_by_at_most_the_stated_share() {
        let delays: Vec<_> = (0..100).map(|seed| jittered(Duration::from_secs(100), seed).as_secs_f64()).collect();
        assert!(delays.iter().all(|delay| (100.0..=110.0).contains(delay)), "{delays:?}");
        let (least, most) = delays.iter().fold((f64::MAX, 0.0_f64), |(l, m), &d| (l.min(d), m.max(d)));
        assert!(most - least > 8.0, "{least} to {most}");
    }
}
