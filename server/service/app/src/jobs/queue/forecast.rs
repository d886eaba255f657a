//! Forecast of a job's duration: its reported fractions, mapped to time by recent jobs of its kind.
//!
//! A procedure reports fractions of its work; phases take different time per fraction, and some report nothing for long.
//! Every successful job stores when it reached which fraction. The next job of its kind is placed on that timeline; while
//! it reports nothing, time advances until the earlier job had reported again.

use serde_json::{Value, json};
use statistics::median;

/// Maximum number of knots of a timeline: enough for every phase of every job, few enough to store with its record.
const KNOTS_LIMIT: usize = 128;

/// Fractions closer than this are merged into one knot.
const KNOT_DISTANCE: f64 = 0.01;

/// Fractions of two jobs within this distance count as equal: half a knot.
const SAME_KNOT: f64 = 0.5 * KNOT_DISTANCE;

/// Weight of the expected against the observed duration, as a fraction of the expected time: dominant at the start,
/// negligible at the end.
const PRIOR_FRACTION: f64 = 0.3;

/// A silent job stops just before the next known report: a phase is not shown as finished before it is, and no job as
/// done before its end.
const HELD_FRACTION: f64 = 0.97;

/// Timeline of a job: (fraction, seconds since the start), both non-decreasing.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::jobs) struct Timeline {
    knots: Vec<(f64, f64)>,
}

impl Timeline {
    /// Records that the job is at `fraction` after `elapsed_s`.
    pub fn note(&mut self, fraction: f64, elapsed_s: f64) {
        let Some(&(last, _)) = self.knots.last() else {
            self.knots.push((fraction, elapsed_s));
            return;
        };
        if fraction <= last || (fraction - last < KNOT_DISTANCE && fraction < 1.0) {
            return;
        }
        // First the time spent at the last fraction, then the new one.
        for knot in [(last, elapsed_s), (fraction, elapsed_s)] {
            if self.knots.len() < KNOTS_LIMIT {
                self.knots.push(knot);
            }
        }
    }

    /// The stored form, for a job that took `took_s` for work of `size`.
    pub fn to_json(&self, took_s: f64, size: f64) -> Value {
        json!({ "took_s": took_s, "size": size, "knots": self.knots })
    }
}

/// A forecast from the last jobs of a kind.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::jobs) struct Forecast {
    /// Expected duration, s.
    expected_s: f64,
    /// Fraction of the work, and fraction of the time at which it was reached or left.
    knots: Vec<(f64, f64)>,
}

impl Forecast {
    /// From the stored timelines of earlier jobs, newest first, for work of `size`; `None` without any.
    pub fn of(kept: &[Value], size: f64) -> Option<Self> {
        let number = |value: &Value| value.as_f64().filter(|number| number.is_finite() && *number > 0.0);
        let mut per_size: Vec<f64> =
            kept.iter().filter_map(|one| Some(number(&one["took_s"])? / number(&one["size"])?)).collect();
        let expected_s = median(&mut per_size)? * size;
        let newest = kept.iter().find(|one| number(&one["took_s"]).is_some())?;
        let took_s = number(&newest["took_s"])?;
        let stored: Vec<(f64, f64)> = serde_json::from_value(newest["knots"].clone()).ok()?;
        let mut knots = vec![(0.0, 0.0)];
        for (fraction, at_s) in stored {
            let (before, share) = knots.last().copied().unwrap_or_default();
            knots.push((fraction.clamp(before, 1.0), (at_s / took_s).clamp(share, 1.0)));
        }
        knots.push((1.0, 1.0));
        Some(Self { expected_s, knots })
    }

    /// Fractions of the time at which a fraction is reached, and until which no update is needed.
    fn shares(&self, fraction: f64) -> (f64, f64) {
        let same = |knot: f64| (knot - fraction).abs() <= SAME_KNOT;
        let Some(first) = self.knots.iter().position(|(knot, _)| *knot >= fraction - SAME_KNOT) else {
            return (1.0, 1.0);
        };
        let (knot, share) = self.knots[first];
        if same(knot) {
            let stood = self.knots[first..].iter().take_while(|(knot, _)| same(*knot));
            return (share, stood.map(|(_, share)| *share).fold(share, f64::max));
        }
        let (low, from) = self.knots[first.max(1) - 1];
        (from + (share - from) * (fraction - low) / (knot - low), share)
    }

    /// Fraction of the time elapsed, and seconds remaining, for a job that reached `fraction` after `reached_s` and is
    /// still there after `now_s`.
    pub fn at(&self, fraction: f64, reached_s: f64, now_s: f64) -> (f64, f64) {
        let (reached, left) = self.shares(fraction);
        let expected_s = self.expected_s;
        let held = reached + HELD_FRACTION * (left - reached);
        let share = (reached + (now_s - reached_s).max(0.0) / expected_s).min(held);
        let prior_s = PRIOR_FRACTION * expected_s;
        // Slowdown of this job relative to the earlier ones, as observed so far.
        let slowness = (now_s + prior_s) / (share * expected_s + prior_s);
        (share, (1.0 - share) * expected_s * slowness)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A job that reports 97.8 % after 24 s, nothing for 17 s, and then ends.
    fn kept(slower: f64) -> Value {
        let mut timeline = Timeline::default();
        for second in 0..=24 {
            timeline.note(0.978 * f64::from(second) / 24.0, slower * f64::from(second));
        }
        timeline.note(1.0, slower * 41.0);
        timeline.to_json(slower * 41.0, 1.0)
    }

    #[test]
    fn a_silent_phase_is_forecast_from_the_timeline_of_the_previous_job() {
        let forecast = Forecast::of(&[kept(1.0)], 1.0).unwrap();
        for (fraction, reached_s, now_s) in
            [(0.0, 0.0, 0.0), (0.489, 12.0, 12.0), (0.978, 24.0, 24.0), (0.978, 24.0, 34.0), (0.978, 24.0, 40.0)]
        {
            let (share, left_s) = forecast.at(fraction, reached_s, now_s);
            assert!((share - now_s / 41.0).abs() < 0.02, "{now_s} s: {share}");
            assert!((left_s - (41.0 - now_s)).abs() < 1.0, "{now_s} s: {left_s}");
        }
        // Longer than before: not done, and some time remains.
        let (share, left_s) = forecast.at(0.9, 20.0, 60.0);
        assert!(share < 0.65 && left_s > 14.0, "{share} {left_s}");
        let (share, left_s) = forecast.at(0.978, 24.0, 120.0);
        assert!(share < 1.0 && left_s > 0.5, "{share} {left_s}");
    }

    #[test]
    fn a_slowdown_is_detected_and_twice_the_work_takes_twice_as_long() {
        let forecast = Forecast::of(&[kept(1.0)], 1.0).unwrap();
        let left_s = |second: f64| forecast.at(0.978 * second / 24.0, 2.0 * second, 2.0 * second).1;
        let errors = [4.0, 12.0, 20.0].map(|second| (left_s(second) / (82.0 - 2.0 * second) - 1.0).abs());
        assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 0.25, "{errors:?}");
        assert_eq!(Forecast::of(&[kept(1.0)], 2.0).unwrap().expected_s, 82.0);
    }

    #[test]
    fn the_median_is_used_and_without_earlier_jobs_there_is_no_forecast() {
        let odd = Forecast::of(&[kept(9.0), kept(1.0), kept(1.0)], 1.0).unwrap();
        assert_eq!(odd.expected_s, 41.0);
        assert_eq!(Forecast::of(&[], 1.0), None);
        assert_eq!(Forecast::of(&[json!({ "rows": 3 })], 1.0), None);
    }

    #[test]
    fn shares_never_decrease_while_a_job_runs() {
        let forecast = Forecast::of(&[kept(1.3)], 1.0).unwrap();
        let mut before = 0.0;
        for step in 0..=1000 {
            let (share, left_s) = forecast.at(f64::from(step) / 1000.0, 0.0, 0.0);
            assert!(share >= before && share <= 1.0 && left_s >= 0.0, "{step}: {share} after {before}");
            before = share;
        }
    }
}
