//! Whether a longer window is biased where the curvature of a line changes.
//!
//! The parabolas of a longer and a shorter window differ by noise, and by bias where the line is no parabola. Averaged
//! over neighbouring columns this difference keeps its bias and loses most of its noise: averaged over half the longer
//! window to either side, a bias of half a standard deviation of the longer window's mean is detected at three standard
//! deviations; the difference in a single column shows one of 2.6 (`docs/maths/centreline.md`).

use super::kernels::{Kernels, MAX_LAG};
use crate::centreline::fast::lanes::{LANES, Numbers};

/// Weights of the averaged difference of two windows.
#[derive(Default)]
pub struct Departure {
    /// Half lengths of the shorter and the longer window.
    half_lengths: [usize; 2],
    /// From the middle outwards.
    weights: Vec<f32>,
    /// Σ w(k) w(k + lag), by lag.
    products: [f64; MAX_LAG + 1],
    /// Variance over that of the longer window's mean.
    gain: f32,
}

impl Departure {
    /// Prepares for two windows, and for noise with these correlations.
    pub fn prepare(&mut self, shorter: &Kernels, longer: &Kernels, correlations: &[f64; MAX_LAG + 1]) {
        let half_lengths = [shorter.half_length(), longer.half_length()];
        if half_lengths != self.half_lengths {
            self.half_lengths = half_lengths;
            self.take_weights(shorter, longer);
        }
        let of_mean = longer.whole();
        let mean =
            of_mean.squared.iter().map(|&square| f64::from(square)).sum::<f64>() * f64::from(of_mean.shared);
        let own = (1..=MAX_LAG).map(|lag| 2.0 * correlations[lag] * self.products[lag]).sum::<f64>();
        self.gain = ((self.products[0] + own) / mean) as f32;
    }

    fn take_weights(&mut self, shorter: &Kernels, longer: &Kernels) {
        let half = longer.half_length();
        let averaged = half / 2;
        let difference = |away: usize| {
            let of =
                |window: &Kernels| window.outwards().get(away).map_or(0.0, |weights| f64::from(weights.value));
            of(longer) - of(shorter)
        };
        let reach = half + averaged;
        let n = (2 * averaged + 1) as f64;
        let weight =
            |at: usize| (0..=2 * averaged).map(|k| difference((at + k).abs_diff(averaged))).sum::<f64>() / n;
        let weights: Vec<f64> = (0..=reach).map(weight).collect();
        let mirrored: Vec<f64> = weights.iter().rev().chain(&weights[1..]).copied().collect();
        self.products =
            std::array::from_fn(|lag| mirrored.iter().zip(mirrored.iter().skip(lag)).map(|(a, b)| a * b).sum());
        self.weights.clear();
        self.weights.extend(weights.iter().map(|&weight| weight as f32));
    }

    /// Columns that it needs on either side.
    pub fn reach(&self) -> usize {
        self.weights.len() - 1
    }

    /// Variance over that of the longer window's mean.
    pub fn gain(&self) -> f32 {
        self.gain
    }

    /// The averaged difference in [`LANES`] columns; the row of the first is at index `at`.
    #[inline(always)]
    pub fn of(&self, rows: &[f32], at: usize) -> Numbers {
        let [middle, weights @ ..] = &self.weights[..] else { return Numbers::default() };
        let mut sum = Numbers::of(&rows[at..]) * *middle;
        let before = rows[at - weights.len()..at + LANES - 1].array_windows().rev();
        let after = rows[at + 1..].array_windows();
        for (&weight, (before, after)) in weights.iter().zip(before.zip(after)) {
            sum = sum + (Numbers(*before) + Numbers(*after)) * weight;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prepared(half: usize) -> (Kernels, Kernels, Departure) {
        let correlations = [0.0; MAX_LAG + 1];
        let (mut shorter, mut longer) = (Kernels::default(), Kernels::default());
        shorter.prepare(half / 2, &correlations);
        longer.prepare(half, &correlations);
        let mut departure = Departure::default();
        departure.prepare(&shorter, &longer, &correlations);
        (shorter, longer, departure)
    }

    #[test]
    fn it_is_the_mean_of_the_differences_of_both_windows() {
        let (shorter, longer, departure) = prepared(10);
        let rows: Vec<f32> = (0..64).map(|k| ((k * k * 7) % 31) as f32 * 0.1).collect();
        let mean = |window: &Kernels, at: usize| -> f32 {
            let whole = &window.whole().value;
            (0..=2 * window.half_length()).map(|k| whole[k] * rows[at + k - window.half_length()]).sum()
        };
        let at = 20;
        let found = departure.of(&rows, at);
        for lane in 0..LANES {
            let columns = at + lane - 5..=at + lane + 5;
            let expected = columns.map(|at| mean(&longer, at) - mean(&shorter, at)).sum::<f32>() / 11.0;
            assert!((found.0[lane] - expected).abs() < 1e-5, "{lane}: {} {expected}", found.0[lane]);
        }
    }

    #[test]
    fn three_standard_deviations_are_half_of_the_longer_windows() {
        for half in [8, 10, 20, 32] {
            let (_, longer, departure) = prepared(half);
            // A line of constant fourth derivative: both windows have the same bias everywhere.
            let rows: Vec<f32> =
                (0..4 * half + LANES).map(|k| ((k as f32 - 2.0 * half as f32) / half as f32).powi(4)).collect();
            let at = 2 * half;
            let whole = &longer.whole().value;
            let bias = (0..=2 * half).map(|k| whole[k] * rows[at + k - half]).sum::<f32>() - rows[at];
            let allowed = 3.0 * departure.gain().sqrt() * bias / departure.of(&rows, at).0[0];
            assert!((0.45..0.55).contains(&allowed.abs()), "{half}: {allowed}");
        }
    }
}
