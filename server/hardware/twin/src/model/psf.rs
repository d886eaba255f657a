//! Lens blur: a separable Gaussian, over the whole image or only the lit pixels.

use std::array::from_fn;

use multiversion::multiversion;

use crate::params::{PSF_RADIUS_PX, PSF_SIGMA_PX};

/// Taps of the sampled Gaussian.
pub(crate) const PSF_TAPS: usize = 2 * PSF_RADIUS_PX + 1;

/// The sampled, normalised point spread function.
pub(crate) fn psf_taps() -> [f32; PSF_TAPS] {
    let raw: [f32; PSF_TAPS] = from_fn(|idx| {
        let x = (idx as f32 - PSF_RADIUS_PX as f32) / PSF_SIGMA_PX;
        (-x * x / 2.0).exp()
    });
    let sum: f32 = raw.iter().sum();
    raw.map(|tap| tap / sum)
}

/// Blurs the pixels `from..to` of `row` along the row into `target`; border pixels are extended beyond the image.
pub(crate) fn blur_along(row: &[f32], from: usize, to: usize, taps: &[f32; PSF_TAPS], target: &mut [f32]) {
    let inner_from = from.max(PSF_RADIUS_PX);
    let inner_to = to.min(row.len().saturating_sub(PSF_RADIUS_PX)).max(inner_from);
    for u in (from..inner_from.min(to)).chain(inner_to.max(from)..to) {
        target[u] = taps.iter().enumerate().map(|(tap, weight)| weight * row[clamped(u, tap, row.len())]).sum();
    }
    if inner_from < inner_to {
        let shifted = from_fn(|tap| &row[inner_from - PSF_RADIUS_PX + tap..]);
        weigh(shifted, taps, &mut target[inner_from..inner_to]);
    }
}

/// Blurs the columns `from..to` of row `v` across the rows into `target`; rows have `width` pixels.
pub(crate) fn blur_across(
    image: &[f32],
    width: usize,
    v: usize,
    (from, to): (usize, usize),
    taps: &[f32; PSF_TAPS],
    target: &mut [f32],
) {
    let height = image.len() / width;
    let rows = from_fn(|tap| &image[clamped(v, tap, height) * width + from..]);
    weigh(rows, taps, &mut target[from..to]);
}

/// Weighted sum of the taps, each at least as long as `target`.
#[multiversion(targets("x86_64+avx2"))]
fn weigh(at: [&[f32]; PSF_TAPS], taps: &[f32; PSF_TAPS], target: &mut [f32]) {
    let n = target.len();
    let at = at.map(|values| &values[..n]);
    for idx in 0..n {
        let mut sum = taps[0] * at[0][idx];
        for tap in 1..PSF_TAPS {
            sum += taps[tap] * at[tap][idx];
        }
        target[idx] = sum;
    }
}

/// Index of a tap around `centre`, clamped to `0..length`.
fn clamped(centre: usize, tap: usize, length: usize) -> usize {
    (centre + tap).saturating_sub(PSF_RADIUS_PX).min(length - 1)
}
