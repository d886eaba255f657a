//! How far a job is in time: its own fractions, read on the clock of the last jobs of its kind.
//!
//! A procedure reports fractions of its work; work of different phases takes different time, and some phases report
//! nothing for long. Every job that succeeds keeps when it was at which fraction. The next one of its kind is as far
//! as that one was in time, and while it reports nothing, the clock goes on until the earlier one had gone on.

use serde_json::{Value, json};
use statistics::median;

/// Knots of a timeline: enough for every phase of every job, few enough to be kept with its record.
const KNOTS_LIMIT: usize = 128;

/// Fractions closer together than this are one knot.
const KNOT_DISTANCE: f64 = 0.01;

/// Fractions of two jobs this close are the same place: half a knot.
const SAME_KNOT: f64 = 0.5 * KNOT_DISTANCE;

/// Share of the expected time that what was expected weighs against what is observed: at first everything, in the end
/// nearly nothing.
const PRIOR_SHARE: f64 = 0.3;

/// A job that says nothing stops short of where it said something the last time: a phase is not over before it is, and
/// no job is done before its end.
const HELD_SHARE: f64 = 0.97;

/// When a job was at which fraction of its own: (fraction, seconds since its beginning), both never falling.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::jobs) struct Timeline {
    knots: Vec<(f64, f64)>,
}

impl Timeline {
    /// The job is at `fraction` after `elapsed_s`.
    pub fn note(&mut self, fraction: f64, elapsed_s: f64) {
        let Some(&(last, _)) = self.knots.last() else {
            self.knots.push((fraction, elapsed_s));
            return;
        };
        if fraction <= last || (fraction - last < KNOT_DISTANCE && fraction < 1.0) {
            return;
        }
        // How long it stood at the last one, then where it is.
        for knot in [(last, elapsed_s), (fraction, elapsed_s)] {
            if self.knots.len() < KNOTS_LIMIT {
                self.knots.push(knot);
            }
        }
    }

    /// As it is kept with the record of a job that took `took_s` for work of `size`.
    pub fn to_json(&self, took_s: f64, size: f64) -> Value {
        json!({ "took_s": took_s, "size": size, "knots": self.knots })
    }
}

/// A forecast from the last jobs of a kind.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::jobs) struct Forecast {
    /// How long it will take, s.
    expected_s: f64,
    /// Fraction of the work, and share of the time at which it was reached or left.
    knots: Vec<(f64, f64)>,
}

impl Forecast {
    /// From what earlier jobs kept, newest first, for work of `size`; `None` if there is none.
    pub fn of(kept: &[Value], size: f64) -> Option<Self> {
        let number = |value: &Value| value.as_f64().filter(|number| number.is_finite() && *number > 0.0);
        let mut per_size: Vec<f64> =
            kept.iter().filter_map(|one| Some(number(&one["took_s"])? / number(&one["size"])?)).collect();
        let expected_s = median(&mut per_size)? * size;
        let newest = kept.iter().find(|one| number(&one["took_s"]).is_some())?;
        let took_s = number(&newest["took_s"])?;
        let told: Vec<(f64, f64)> = serde_json::from_value(newest["knots"].clone()).ok()?;
        let mut knots = vec![(0.0, 0.0)];
        for (fraction, at_s) in told {
            let (before, share) = knots.last().copied().unwrap_or_default();
            knots.push((fraction.clamp(before, 1.0), (at_s / took_s).clamp(share, 1.0)));
        }
        knots.push((1.0, 1.0));
        Some(Self { expected_s, knots })
    }

    /// Shares of the time at which a fraction is reached, and until which no update is needed.
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

    /// Share of the time that is over, and seconds left, for a job that reached `fraction` after `reached_s` and is
    /// there still after `now_s`.
    pub fn at(&self, fraction: f64, reached_s: f64, now_s: f64) -> (f64, f64) {
        let (reached, left) = self.shares(fraction);
        let expected_s = self.expected_s;
        let held = reached + HELD_SHARE * (left - reached);
        let share = (reached + (now_s - reached_s).max(0.0) / expected_s).min(held);
        let prior_s = PRIOR_SHARE * expected_s;
        // How much slower this job is than those before, as far as is known by now.
        let slowness = (now_s + prior_s) / (share * expected_s + prior_s);
        (share, (1.0 - share) * expected_s * slowness)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A job that says 97.8 % after 24 s, nothing for 17 s, and is done.
    fn kept(slower: f64) -> Value {
        let mut timeline = Timeline::default();
        for second in 0..=24 {
            timeline.note(0.978 * f64::from(second) / 24.0, slower * f64::from(second));
        }
        timeline.note(1.0, slower * 41.0);
        timeline.to_json(slower * 41.0, 1.0)
    }

    #[test]
    fn a_phase_that_says_nothing_is_foretold_by_the_clock_of_the_job_before() {
        let forecast = Forecast::of(&[kept(1.0)], 1.0).unwrap();
        for (fraction, reached_s, now_s) in
            [(0.0, 0.0, 0.0), (0.489, 12.0, 12.0), (0.978, 24.0, 24.0), (0.978, 24.0, 34.0), (0.978, 24.0, 40.0)]
        {
            let (share, left_s) = forecast.at(fraction, reached_s, now_s);
            assert!((share - now_s / 41.0).abs() < 0.02, "{now_s} s: {share}");
            assert!((left_s - (41.0 - now_s)).abs() < 1.0, "{now_s} s: {left_s}");
        }
        // Longer than before: not done, and not nothing left.
        let (share, left_s) = forecast.at(0.9, 20.0, 60.0);
        assert!(share < 0.65 && left_s > 14.0, "{share} {left_s}");
        let (share, left_s) = forecast.at(0.978, 24.0, 120.0);
        assert!(share < 1.0 && left_s > 0.5, "{share} {left_s}");
    }

    #[test]
    fn a_slower_machine_is_noticed_and_twice_the_work_takes_twice_as_long() {
        let forecast = Forecast::of(&[kept(1.0)], 1.0).unwrap();
        let left_s = |second: f64| forecast.at(0.978 * second / 24.0, 2.0 * second, 2.0 * second).1;
        let errors = [4.0, 12.0, 20.0].map(|second| (left_s(second) / (82.0 - 2.0 * second) - 1.0).abs());
        assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 0.25, "{errors:?}");
        assert_eq!(Forecast::of(&[kept(1.0)], 2.0).unwrap().expected_s, 82.0);
    }

    #[test]
    fn the_median_counts_and_without_earlier_jobs_nothing_is_foretold() {
        let odd = Forecast::of(&[kept(9.0), kept(1.0), kept(1.0)], 1.0).unwrap();
        assert_eq!(odd.expected_s, 41.0);
        assert_eq!(Forecast::of(&[], 1.0), None);
        assert_eq!(Forecast::of(&[json!({ "rows": 3 })], 1.0), None);
    }

    #[test]
    fn shares_never_fall_while_a_job_goes_on() {
        let forecast = Forecast::of(&[kept(1.3)], 1.0).unwrap();
        let mut before = 0.0;
        for step in 0..=1000 {
            let (share, left_s) = forecast.at(f64::from(step) / 1000.0, 0.0, 0.0);
            assert!(share >= before && share <= 1.0 && left_s >= 0.0, "{step}: {share} after {before}");
            before = share;
        }
    }
}
