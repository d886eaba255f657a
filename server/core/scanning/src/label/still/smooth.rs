//! Lines that surely have no kink, at a quick look in single precision: most have none, and need no closer one.

use crate::params::{KINK_SLOPE, KINK_SPAN_PX, KINK_STEP_PX, STEP_LIMITS};

/// What a quick look may be wrong by while a line stays within [`REACH_PX`]: 50 roundings of that, with room to spare.
const TOLERANCE_PX: f32 = 0.01;

/// How far a line may run across from where it begins.
const REACH_PX: f32 = 2048.0;

/// Share of a limit by which it may be wrong itself.
const LIMIT_ERROR: f32 = 1e-5;

/// Points of the narrower and of the wider windows for steps.
const NARROW: usize = STEP_LIMITS[0].0;
/// See [`NARROW`].
const WIDE: usize = STEP_LIMITS[1].0;
const _: () = assert!(NARROW == 8 && WIDE == 16, "windows are doubled from four points");

/// Sums over windows of points from every point on.
#[derive(Debug, Default)]
struct Windows {
    /// Σ y.
    sums: Vec<f32>,
    /// Σ (2 j − n + 1) y over j = 0 … n − 1.
    tilts: Vec<f32>,
}

/// Memory of the quick look.
#[derive(Debug, Default)]
pub struct QuickLook {
    /// Positions across from the first point, and the noise of each.
    across: Vec<f32>,
    noise: Vec<f32>,
    four: Windows,
    narrow: Windows,
    wide: Windows,
}

impl QuickLook {
    /// Whether nothing of a segment comes near the limits of jumps, bends and steps. A point's noise is `correlation` times
    /// its σ.
    #[inline(always)]
    pub fn is_smooth(&mut self, across: &[f64], sigma_px: &[f64], correlation: f64) -> bool {
        let Self { across: y, noise, four, narrow, wide } = self;
        let n = across.len();
        let (y, noise) = (sized(y, n), sized(noise, n));
        let sigma_px = &sigma_px[..n];
        let mut n_suspects = 0;
        for i in 0..n {
            y[i] = (across[i] - across[0]) as f32;
            noise[i] = (sigma_px[i] * correlation) as f32;
            n_suspects += u32::from(y[i].abs() > REACH_PX);
        }
        n_suspects += n_jumps(y) + n_bends(y);
        if n >= 2 * NARROW {
            four.sum_up(y);
            narrow.double::<4>(four, n + 1 - NARROW);
            n_suspects += narrow.n_steps::<NARROW>(noise, STEP_LIMITS[0]);
        }
        if n >= 2 * WIDE {
            wide.double::<NARROW>(narrow, n + 1 - WIDE);
            n_suspects += wide.n_steps::<WIDE>(noise, STEP_LIMITS[1]);
        }
        n_suspects == 0
    }
}

#[inline(always)]
fn sized(list: &mut Vec<f32>, n: usize) -> &mut [f32] {
    if list.len() < n {
        list.resize(n, 0.0);
    }
    &mut list[..n]
}

#[inline(always)]
fn n_jumps(y: &[f32]) -> u32 {
    let n = y.len() - 1;
    let (before, here) = (&y[..n], &y[1..][..n]);
    let mut n_jumps = 0;
    for i in 0..n {
        n_jumps += u32::from((here[i] - before[i]).abs() > KINK_STEP_PX as f32 - TOLERANCE_PX);
    }
    n_jumps
}

#[inline(always)]
fn n_bends(y: &[f32]) -> u32 {
    let n = y.len().saturating_sub(2 * KINK_SPAN_PX);
    let (behind, here, ahead) = (&y[..n], &y[KINK_SPAN_PX.min(y.len())..], &y[y.len() - n..]);
    let here = &here[..n];
    let limit = KINK_SLOPE as f32 * KINK_SPAN_PX as f32 - TOLERANCE_PX;
    let mut n_bends = 0;
    for i in 0..n {
        n_bends += u32::from(((ahead[i] - here[i]) - (here[i] - behind[i])).abs() > limit);
    }
    n_bends
}

impl Windows {
    #[inline(always)]
    fn sized(&mut self, n: usize) -> (&mut [f32], &mut [f32]) {
        (sized(&mut self.sums, n), sized(&mut self.tilts, n))
    }

    /// Windows of four points.
    #[inline(always)]
    fn sum_up(&mut self, y: &[f32]) {
        let n = y.len() - 3;
        let (first, second, third, fourth) = (&y[..n], &y[1..][..n], &y[2..][..n], &y[3..][..n]);
        let (sums, tilts) = self.sized(n);
        for i in 0..n {
            sums[i] = (first[i] + fourth[i]) + (second[i] + third[i]);
            tilts[i] = 3.0 * (fourth[i] - first[i]) + (third[i] - second[i]);
        }
    }

    /// `n` windows of twice the `HALF` points of those before.
    #[inline(always)]
    fn double<const HALF: usize>(&mut self, half: &Self, n: usize) {
        let (sum, next_sum) = (&half.sums[..n], &half.sums[HALF..][..n]);
        let (tilt, next_tilt) = (&half.tilts[..n], &half.tilts[HALF..][..n]);
        let (sums, tilts) = self.sized(n);
        for i in 0..n {
            sums[i] = sum[i] + next_sum[i];
            tilts[i] = (tilt[i] + next_tilt[i]) + HALF as f32 * (next_sum[i] - sum[i]);
        }
    }

    /// At how many points the lines through the points before and after miss each other by about the limit or more.
    #[inline(always)]
    fn n_steps<const SPAN: usize>(&self, noise: &[f32], (_, sigmas, least_px): (usize, f64, f64)) -> u32 {
        let n = noise.len() + 1 - 2 * SPAN;
        let (before, after) = (&self.sums[..n], &self.sums[SPAN..][..n]);
        let (tilt_before, tilt_after) = (&self.tilts[..n], &self.tilts[SPAN..][..n]);
        let noise = &noise[SPAN..][..n];
        let sigmas = sigmas as f32 * (1.0 - LIMIT_ERROR);
        let least_px = least_px as f32 - TOLERANCE_PX;
        // Half a point beyond its window a line is Σ y / n ± 3 Σ (2 j − n + 1) y / (n² − 1).
        let (mean, slope) = (1.0 / SPAN as f32, 3.0 / (SPAN * SPAN - 1) as f32);
        let mut n_steps = 0;
        for i in 0..n {
            let miss = slope * (tilt_before[i] + tilt_after[i]) - mean * (after[i] - before[i]);
            let limit = sigmas * noise[i] - TOLERANCE_PX;
            let limit = if limit > least_px { limit } else { least_px };
            n_steps += u32::from(miss.abs() > limit);
        }
        n_steps
    }
}
