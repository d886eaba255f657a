//! Windows of one length, and the fits in windows truncated by the ends of a line.

use super::cut::{Cut, Near};
use super::kernels::{Kernel, Kernels, MAX_LAG, RUN};
use super::means::Mean;
use crate::centreline::fast::lanes::{LANES, Numbers};

/// Windows of one length.
#[derive(Default)]
pub struct Windows {
    kernels: Kernels,
    cut: Cut,
}

/// Some neighbouring columns of a piece.
#[derive(Clone, Copy)]
pub struct Block {
    pub start: usize,
    /// Columns of the whole piece.
    pub n: usize,
}

/// Values along a piece.
#[derive(Clone, Copy)]
pub struct Along<'a> {
    pub numbers: &'a [f32],
    /// Index of the value of the block's first column.
    pub at: usize,
}

impl Windows {
    /// Prepares for windows of `half_length` points on either side, and for noise with these correlations.
    pub fn prepare(&mut self, half_length: usize, correlations: &[f64; MAX_LAG + 1]) {
        self.kernels.prepare(half_length, correlations);
        self.cut.prepare(&mut self.kernels);
    }

    /// The weights of these windows.
    pub fn kernels(&self) -> &Kernels {
        &self.kernels
    }

    /// Refits value and variance where the line ends inside the window, and sets 1 where it holds enough points.
    #[inline(always)]
    pub fn cut_means(&mut self, block: Block, rows: Along, variances: Along, mean: &mut Mean) -> Numbers {
        let Self { kernels, cut } = self;
        let mut valid = Numbers::splat(1.0);
        if cut.is_for(block.n) {
            for near in block.near_ends(kernels.half_length()) {
                let (rows, variances) = (block.towards(near, rows), block.towards(near, variances));
                let (of_cut, holds_enough) = cut.mean(near, rows, variances);
                for i in near.first..near.past_last {
                    mean.value.0[i] = of_cut.value.0[i];
                    mean.variance.0[i] = of_cut.variance.0[i];
                    valid.0[i] = holds_enough.0[i];
                }
            }
            return valid;
        }
        for i in block.cut(kernels.half_length()) {
            let (kernel, before) = block.kernel_at(kernels, i);
            valid.0[i] = if kernel.value.is_empty() { 0.0 } else { 1.0 };
            mean.value.0[i] = sum(&kernel.value, &rows.numbers[rows.at + i - before..]);
            let variances = &variances.numbers[variances.at + i - before..];
            mean.variance.0[i] = sum(&kernel.squared, variances) * kernel.shared;
        }
        valid
    }

    /// Refits slopes where the line ends inside the window, in the lanes that have `chosen` it.
    #[inline(always)]
    pub fn cut_slopes(&mut self, block: Block, rows: Along, chosen: &Numbers, slopes: &mut Numbers) {
        let Self { kernels, cut } = self;
        let is_chosen = |i: &usize| chosen.0[*i] > 0.0;
        if cut.is_for(block.n) {
            for near in block.near_ends(kernels.half_length()) {
                let of_cut = cut.slopes(near, block.towards(near, rows));
                for i in (near.first..near.past_last).filter(is_chosen) {
                    slopes.0[i] = of_cut.0[i];
                }
            }
            return;
        }
        for i in block.cut(kernels.half_length()).filter(is_chosen) {
            let (kernel, before) = block.kernel_at(kernels, i);
            slopes.0[i] = sum(&kernel.slope, &rows.numbers[rows.at + i - before..]);
        }
    }
}

impl Block {
    /// Whether all of its columns have `n_beside` neighbours on either side.
    #[inline(always)]
    pub fn is_whole(self, n_beside: usize) -> bool {
        self.start >= n_beside && self.start + LANES + n_beside <= self.n
    }

    /// Columns whose windows are truncated by the ends of the piece.
    #[inline(always)]
    fn cut(self, half_length: usize) -> impl Iterator<Item = usize> {
        let n_columns = LANES.min(self.n - self.start);
        let n_first = half_length.saturating_sub(self.start).min(n_columns);
        let last = (self.n.saturating_sub(half_length + self.start)).clamp(n_first, n_columns);
        (0..n_first).chain(last..n_columns)
    }

    /// Those columns near either end of the piece.
    #[inline(always)]
    fn near_ends(self, half_length: usize) -> impl Iterator<Item = Near> {
        let beginning = Near::beginning(self.start, half_length);
        beginning.into_iter().chain(Near::end(self.start, self.n, half_length))
    }

    /// Values from the beginning of the piece on, or up to its end if `near` is at the end.
    #[inline(always)]
    fn towards<'a>(self, near: Near, along: Along<'a>) -> &'a [f32] {
        let Along { numbers, at } = along;
        if near.is_last { &numbers[..at + self.n - self.start] } else { &numbers[at - self.start..] }
    }

    /// The kernel for column `i`, and how many points before the column it begins.
    #[inline(always)]
    fn kernel_at(self, kernels: &mut Kernels, i: usize) -> (&Kernel, usize) {
        let (idx, half) = (self.start + i, kernels.half_length());
        let before = idx.min(half);
        (kernels.at(before, (self.n - 1 - idx).min(half)), before)
    }
}

/// Sum with the kernel of one window; numbers beyond its end meet zero weights.
#[inline(always)]
fn sum(weights: &[f32], numbers: &[f32]) -> f32 {
    let mut sums = [0.0f32; RUN];
    for (weights, numbers) in weights.as_chunks::<RUN>().0.iter().zip(numbers.as_chunks::<RUN>().0) {
        for i in 0..RUN {
            sums[i] += weights[i] * numbers[i];
        }
    }
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}
