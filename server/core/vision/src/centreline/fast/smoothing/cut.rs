//! Parabolas fitted near the ends of a line, where windows are truncated: the columns of a block side by side, each
//! with the weights of its own window.

use super::kernels::Kernels;
use super::means::Mean;
use crate::centreline::fast::lanes::{LANES, Numbers};

/// Weights of the crossings from the end of a line inwards, in the windows about its first columns. At the other end of
/// the line the same weights apply in reverse order.
#[derive(Default)]
pub struct Cut {
    half_length: usize,
    /// Row length of the weights: the columns side by side, padded with one vector of zeros before the first and after
    /// the last.
    stride: usize,
    /// By crossing.
    value: Vec<f32>,
    squared: Vec<f32>,
    slope: Vec<f32>,
    /// 1 for columns whose windows hold enough crossings, otherwise 0.
    valid: Vec<f32>,
    shared: Vec<f32>,
}

/// Some columns near an end of a line.
#[derive(Clone, Copy)]
pub struct Near {
    /// Index of the first of them among the columns side by side.
    offset: usize,
    /// Whether the line ends after them.
    pub is_last: bool,
    /// Lanes whose windows are truncated.
    pub first: usize,
    pub past_last: usize,
}

impl Near {
    /// The columns from `start` on, of a line of `n`, whose windows of this half length are truncated by the line's
    /// beginning.
    #[inline(always)]
    pub fn beginning(start: usize, half_length: usize) -> Option<Self> {
        let past_last = half_length.saturating_sub(start).min(LANES);
        (past_last > 0).then_some(Self { offset: LANES + start, is_last: false, first: 0, past_last })
    }

    /// The same for windows truncated by the line's end.
    #[inline(always)]
    pub fn end(start: usize, n: usize, half_length: usize) -> Option<Self> {
        let past_last = LANES.min(n - start);
        let first = n.saturating_sub(half_length + start);
        // The last lane is as far from the end as the first column counted from there.
        (first < past_last).then(|| Self { offset: n - start, is_last: true, first, past_last })
    }
}

impl Cut {
    /// Copies the weights of the truncated windows of some kernels and the noise correlation of the current image.
    pub fn prepare(&mut self, kernels: &mut Kernels) {
        let half = kernels.half_length();
        if half != self.half_length {
            self.take_weights(kernels);
        }
        for before in 0..half {
            let kernel = kernels.at(before, half);
            self.shared[LANES + before] = kernel.shared;
        }
    }

    fn take_weights(&mut self, kernels: &mut Kernels) {
        let half = kernels.half_length();
        (self.half_length, self.stride) = (half, half + 2 * LANES);
        for weights in [&mut self.value, &mut self.squared, &mut self.slope] {
            weights.clear();
            weights.resize(2 * half * self.stride, 0.0);
        }
        for of_columns in [&mut self.valid, &mut self.shared] {
            of_columns.clear();
            of_columns.resize(self.stride, 0.0);
        }
        for before in 0..half {
            let kernel = kernels.at(before, half);
            if kernel.value.is_empty() {
                continue;
            }
            self.valid[LANES + before] = 1.0;
            for place in 0..=before + half {
                let idx = place * self.stride + LANES + before;
                self.value[idx] = kernel.value[place];
                self.squared[idx] = kernel.squared[place];
                self.slope[idx] = kernel.slope[place];
            }
        }
    }

    /// Whether, for lines of `n` columns, every window is truncated on one side only.
    #[inline(always)]
    pub fn is_for(&self, n: usize) -> bool {
        n >= 2 * self.half_length
    }

    /// Means of the windows about some columns, and 1 where they hold enough crossings. `rows` and `variances` start at
    /// the beginning of the line, or end at its end if `near` is at the end.
    #[inline(always)]
    pub fn mean(&self, near: Near, rows: &[f32], variances: &[f32]) -> (Mean, Numbers) {
        let (value, variance) = if near.is_last {
            (self.sum(&self.value, near, rows.iter().rev()), self.sum(&self.squared, near, variances.iter().rev()))
        } else {
            (self.sum(&self.value, near, rows.iter()), self.sum(&self.squared, near, variances.iter()))
        };
        let variance = variance * Numbers::of(&self.shared[near.offset..]);
        let valid = Numbers::of(&self.valid[near.offset..]);
        (Mean { value: near.turned(value), variance: near.turned(variance) }, near.turned(valid))
    }

    /// Slopes in the windows about some columns; `rows` as for the means.
    #[inline(always)]
    pub fn slopes(&self, near: Near, rows: &[f32]) -> Numbers {
        let slopes = if near.is_last {
            self.sum(&self.slope, near, rows.iter().rev()) * -1.0
        } else {
            self.sum(&self.slope, near, rows.iter())
        };
        near.turned(slopes)
    }

    /// Sum of numbers with a set of weights.
    #[inline(always)]
    fn sum<'a>(&self, weights: &[f32], near: Near, numbers: impl Iterator<Item = &'a f32>) -> Numbers {
        let weights = weights.chunks_exact(self.stride).zip(numbers);
        weights.fold(Numbers::default(), |sum, (weights, &number)| {
            sum + Numbers::of(&weights[near.offset..]) * number
        })
    }
}

impl Near {
    /// Reverses the lanes where the columns are at the other end of a line.
    #[inline(always)]
    fn turned(self, numbers: Numbers) -> Numbers {
        let mut turned = numbers;
        if self.is_last {
            for i in 0..LANES {
                turned.0[i] = numbers.0[LANES - 1 - i];
            }
        }
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::super::kernels::MAX_LAG;
    use super::*;

    #[test]
    fn columns_fitted_together_agree_with_individual_kernels() {
        const HALF: usize = 20;
        const N: usize = 55;
        let mut kernels = Kernels::default();
        let mut correlations = [0.0; MAX_LAG + 1];
        correlations[1] = 0.3;
        kernels.prepare(HALF, &correlations);
        let mut cut = Cut::default();
        cut.prepare(&mut kernels);
        assert!(cut.is_for(2 * HALF) && !cut.is_for(2 * HALF - 1));
        let mut state = 7u32;
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let rows: Vec<f32> = (0..N).map(|_| number()).collect();
        let variances: Vec<f32> = (0..N).map(|_| number()).collect();
        let mut n_compared = 0;
        for start in (0..N).step_by(LANES) {
            for near in [Near::beginning(start, HALF), Near::end(start, N, HALF)].into_iter().flatten() {
                let ((mean, valid), slopes) = (cut.mean(near, &rows, &variances), cut.slopes(near, &rows));
                for i in near.first..near.past_last {
                    let (before, after) = ((start + i).min(HALF), (N - 1 - start - i).min(HALF));
                    assert!(before < HALF || after < HALF, "column {} is not cut", start + i);
                    let kernel = kernels.at(before, after);
                    let sum = |weights: &[f32], numbers: &[f32]| -> f32 {
                        weights.iter().zip(&numbers[start + i - before..]).map(|(w, x)| w * x).sum()
                    };
                    let pairs = [
                        (mean.value.0[i], sum(&kernel.value, &rows)),
                        (mean.variance.0[i], sum(&kernel.squared, &variances) * kernel.shared),
                        (slopes.0[i], sum(&kernel.slope, &rows)),
                        (valid.0[i], 1.0),
                    ];
                    pairs
                        .iter()
                        .for_each(|(a, b)| assert!((a - b).abs() < 2e-6, "column {}: {pairs:?}", start + i));
                    n_compared += 1;
                }
            }
        }
        assert_eq!(n_compared, 2 * HALF);
    }
}
