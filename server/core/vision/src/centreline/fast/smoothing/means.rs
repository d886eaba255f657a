//! Parabolas fitted by whole windows about neighbouring points, with the windows of all lengths in one pass.

use super::kernels::Kernels;
use crate::centreline::fast::lanes::{LANES, Numbers};
use crate::params::{ALONG_MAX_HALF_LENGTH, ALONG_MIN_HALF_LENGTH};

/// Most windows of different lengths, each twice the one before: 4, 8, 16 and 32 points on either side.
pub const MAX_WINDOWS: usize = 4;
const _: () = assert!(ALONG_MAX_HALF_LENGTH < ALONG_MIN_HALF_LENGTH << MAX_WINDOWS);

/// Value of the parabolas at the middle of their windows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mean {
    pub value: Numbers,
    pub variance: Numbers,
}

/// Weights of a point in the windows of all lengths, by its distance from the middle; before the middle they are the
/// same, with the opposite sign for the slope.
#[derive(Debug, Clone, Copy, Default)]
struct Step {
    /// For the values, the longest window last; zero in windows that do not contain the point.
    values: [f32; MAX_WINDOWS],
    /// For their variances.
    squares: [f32; MAX_WINDOWS],
    /// For the slope in the longest window.
    slope: f32,
}

/// Windows of all lengths, prepared for one pass over their points.
#[derive(Default)]
pub struct AllWindows {
    /// From the middle on.
    steps: Vec<Step>,
    /// Points on either side, the shortest window first.
    halves: Vec<usize>,
    /// Factors on the variances, the longest window last.
    shared: [f32; MAX_WINDOWS],
}

/// Fits by whole windows, one point per lane.
pub struct Whole {
    /// For windows of every length, the longest last.
    pub means: [Mean; MAX_WINDOWS],
    /// In the longest window, per column.
    pub slope: Numbers,
}

impl AllWindows {
    /// Uses the windows of some kernels, at most [`MAX_WINDOWS`], the shortest first.
    pub fn prepare<'a>(&mut self, kernels: impl ExactSizeIterator<Item = &'a Kernels>) {
        self.steps.clear();
        self.halves.clear();
        for (idx, kernels) in (MAX_WINDOWS - kernels.len()..).zip(kernels) {
            self.steps.resize(kernels.half_length() + 1, Step::default());
            for (step, weights) in self.steps.iter_mut().zip(kernels.outwards()) {
                (step.values[idx], step.squares[idx]) = (weights.value, weights.squared);
                step.slope = weights.slope;
            }
            self.halves.push(kernels.half_length());
            self.shared[idx] = kernels.whole().shared;
        }
    }

    /// Fits [`LANES`] points. `rows` and `variances` start as many points before the first as the longest window
    /// reaches.
    #[inline(always)]
    pub fn fit(&self, rows: &[f32], variances: &[f32]) -> Whole {
        let longest = self.steps.len() - 1;
        let (middle, middle_variance) = (Numbers::of(&rows[longest..]), Numbers::of(&variances[longest..]));
        let step = &self.steps[0];
        let mut whole = Whole { means: [Mean::default(); MAX_WINDOWS], slope: Numbers::default() };
        for idx in 0..MAX_WINDOWS {
            whole.means[idx].value = middle * step.values[idx];
            whole.means[idx].variance = middle_variance * step.squares[idx];
        }
        let mut from = 0;
        for (idx, &to) in self.halves.iter().enumerate() {
            let ring = Ring::new(&self.steps, rows, variances, from..to);
            from = to;
            match self.halves.len() - idx {
                1 => ring.add::<1>(&mut whole),
                2 => ring.add::<2>(&mut whole),
                3 => ring.add::<3>(&mut whole),
                _ => ring.add::<MAX_WINDOWS>(&mut whole),
            }
        }
        for idx in 0..MAX_WINDOWS {
            whole.means[idx].variance = whole.means[idx].variance * self.shared[idx];
        }
        whole
    }
}

/// Slopes of the parabolas in one whole window, per column. `rows` start as many points before the first as it reaches.
#[inline(always)]
pub fn slopes(window: &Kernels, rows: &[f32]) -> Numbers {
    let half = window.half_length();
    let weights = window.outwards().get(1..).unwrap_or_default();
    let pairs = weights.iter().zip(pairs(rows, half));
    pairs.fold(Numbers::default(), |slope, (weights, (before, after))| slope + (after - before) * weights.slope)
}

/// Points within a range of distances from the middles, which the same windows contain.
struct Ring<'a> {
    steps: &'a [Step],
    before: &'a [f32],
    after: &'a [f32],
    variances_before: &'a [f32],
    variances_after: &'a [f32],
}

impl<'a> Ring<'a> {
    /// Points more than `away.start` and at most `away.end` from the middles.
    #[inline(always)]
    fn new(steps: &'a [Step], rows: &'a [f32], variances: &'a [f32], away: std::ops::Range<usize>) -> Self {
        let longest = steps.len() - 1;
        let before = longest - away.end..longest - away.start + LANES - 1;
        let after = longest + away.start + 1..longest + away.end + LANES;
        Self {
            steps: &steps[away.start + 1..=away.end],
            before: &rows[before.clone()],
            after: &rows[after.clone()],
            variances_before: &variances[before],
            variances_after: &variances[after],
        }
    }

    /// Adds them to the fits of the `N` longest windows.
    #[inline(always)]
    fn add<const N: usize>(&self, whole: &mut Whole) {
        let Some(means) = whole.means.last_chunk_mut::<N>() else { return };
        let mut sums = *means;
        let mut slope = whole.slope;
        let rows = self.before.array_windows().rev().zip(self.after.array_windows());
        let variances = self.variances_before.array_windows().rev().zip(self.variances_after.array_windows());
        for (step, ((before, after), (variance_before, variance_after))) in
            self.steps.iter().zip(rows.zip(variances))
        {
            let (before, after) = (Numbers(*before), Numbers(*after));
            let both = before + after;
            let variance = Numbers(*variance_before) + Numbers(*variance_after);
            for i in 0..N {
                sums[i].value = sums[i].value + both * step.values[MAX_WINDOWS - N + i];
                sums[i].variance = sums[i].variance + variance * step.squares[MAX_WINDOWS - N + i];
            }
            slope = slope + (after - before) * step.slope;
        }
        *means = sums;
        whole.slope = slope;
    }
}

/// Neighbouring numbers before and after those at index `half`, the nearest pair first.
#[inline(always)]
fn pairs(numbers: &[f32], half: usize) -> impl Iterator<Item = (Numbers, Numbers)> {
    let before = numbers[..half + LANES - 1].array_windows().rev();
    let after = numbers[half + 1..].array_windows();
    before.zip(after).map(|(before, after)| (Numbers(*before), Numbers(*after)))
}
