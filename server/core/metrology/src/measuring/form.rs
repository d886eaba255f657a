//! Flatness: the band of the points about their least-squares plane, corrected for noise.
//!
//! Noise widens the band: it combines with the form somewhere between linearly (a flat plate) and in quadrature (a form
//! error much larger than the noise). The value is the mean of the two corrections; half their difference is the limit
//! of the correction's error (eq. 3 of `docs/maths/metrology.md`).

use statistics::{SIGMA_PER_MAD, median};
use statrs::function::erf::erfc;

use crate::fitting::features::FeatureFit;
use crate::fitting::fit::{Points, Weighted, fit};
use crate::fitting::robust::{normalised_distance, within};
use crate::fitting::sample::Samples;
use crate::interface::shape::Shape;
use crate::measuring::noise::{correlation_px, redundancy, spacing_px};
use crate::measuring::value::band_width;
use crate::params::{FLATNESS_FRACTION, FLATNESS_TRIM_SIGMAS, TRIM_SIGMAS};

/// Quantile of the standard normal distribution at the ends of [`FLATNESS_FRACTION`], and its density there.
const TAIL_QUANTILE: f64 = 3.290_5;
const TAIL_DENSITY: f64 = 0.001_780;

/// Points whose noise gives the width of the zone.
const BAND_POINTS: usize = 2000;

/// Distance, in correlation lengths, of the neighbours whose differences give the noise.
const LAG_CORRELATIONS: f64 = 2.0;

/// A flatness corrected for noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flatness {
    /// The form alone, mm.
    pub(crate) value_mm: f64,
    /// Width of the band of the points, noise included, mm.
    pub(crate) band_mm: f64,
    /// Width of the band due to noise alone, mm.
    pub(crate) noise_band_mm: f64,
    /// RMS of the form, √(rms² − σ²), mm.
    pub(crate) form_rms_mm: f64,
    /// Standard uncertainty from the noise and from its correction, mm.
    pub(crate) standard_uncertainty_mm: f64,
    /// Points with independent noise.
    pub(crate) n_independent: f64,
}

/// Points with equal weight.
pub(crate) struct EqualWeights<'a> {
    pub(crate) samples: &'a Samples<'a>,
    pub(crate) indices: &'a [u32],
}

impl Points for EqualWeights<'_> {
    fn len(&self) -> usize {
        self.indices.len()
    }

    fn at(&self, idx: usize) -> Weighted {
        let sample = self.samples.at(self.indices[idx]);
        Weighted { position: sample.in_part.xyz, ray: sample.ray, weight: 1.0 }
    }
}

/// Extends a plane's points to all inside its outline that are form rather than outliers, and fits their least-squares
/// plane with equal weights.
pub(crate) fn keep_form(samples: &Samples, plane: &mut FeatureFit) -> Option<()> {
    let mut normalised: Vec<f64> =
        plane.inliers.iter().map(|&idx| normalised_distance(&plane.shape, &samples.at(idx)).abs()).collect();
    let scale = SIGMA_PER_MAD * median(&mut normalised).unwrap_or(0.0);
    let kept = within(samples, &plane.inside, &plane.shape, scale * FLATNESS_TRIM_SIGMAS.max(TRIM_SIGMAS));
    plane.shape = fit(&plane.shape, &EqualWeights { samples, indices: &kept })?;
    plane.n_outliers = plane.inside.len() - kept.len();
    plane.inliers = kept;
    Some(())
}

/// The flatness of a plane's points.
pub(crate) fn flatness(samples: &Samples, plane: &FeatureFit) -> Flatness {
    let residuals: Vec<f64> =
        plane.inliers.iter().map(|&idx| plane.shape.distance_mm(&samples.position(idx))).collect();
    without_noise(samples, (&plane.inliers, &plane.shape), &residuals, band_width)
}

/// The width of a form's zone without the contribution of noise. `residuals`: of the points `inliers` of a shape, mm;
/// `band`: the width of the zone that holds 99.9 % of them.
pub(crate) fn without_noise(
    samples: &Samples,
    (inliers, shape): (&[u32], &Shape),
    residuals: &[f64],
    band: impl Fn(&mut [f64]) -> f64,
) -> Flatness {
    let n = residuals.len() as f64;
    let mean = residuals.iter().sum::<f64>() / n;
    let square = residuals.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / n;
    let noise_mm = differences_mm(samples, inliers, residuals)
        .unwrap_or_else(|| predicted_mm(samples, inliers, shape))
        .min(square.sqrt());
    let band_mm = band(&mut residuals.to_vec());
    let noise_band_mm = noise_band_mm(samples, inliers, shape, noise_mm);
    let linear = |band_mm: f64| (band_mm - noise_band_mm).max(0.0);
    let quadratic = |band_mm: f64| (band_mm * band_mm - noise_band_mm * noise_band_mm).max(0.0).sqrt();
    let value = |band_mm| (linear(band_mm) + quadratic(band_mm)) / 2.0;
    let n_independent = n / redundancy(samples, inliers);
    let tail = (1.0 - FLATNESS_FRACTION) / 2.0;
    let of_quantiles = noise_mm * (2.0 * tail * (1.0 - tail) / n_independent).sqrt() / TAIL_DENSITY;
    // By steps, since the derivative is infinite where the band is that of the noise; the value is zero below.
    let of_step = (value(band_mm + of_quantiles) - value(band_mm - of_quantiles)) / 2.0;
    let of_band = of_step.max(of_quantiles);
    // The ends are more likely than the middle: an arcsine distribution of this half-width.
    let of_correction = (quadratic(band_mm) - linear(band_mm)) / 2.0 / 2f64.sqrt();
    Flatness {
        value_mm: value(band_mm),
        band_mm,
        noise_band_mm,
        form_rms_mm: (square - noise_mm * noise_mm).max(0.0).sqrt(),
        standard_uncertainty_mm: of_band.hypot(of_correction),
        n_independent,
    }
}

/// The noise of the points along the normal, mm: from second differences of points of one line, far enough apart for
/// independent noise and close enough for equal form. `None` if no line is long enough for that.
fn differences_mm(samples: &Samples, inliers: &[u32], residuals: &[f64]) -> Option<f64> {
    let lag_px = LAG_CORRELATIONS * correlation_px(samples.cloud);
    let spacing = |i: usize, j: usize| spacing_px(samples, inliers[i], inliers[j]);
    let beyond = |from: usize, start: usize, lag_px: f64| {
        let mut idx = start;
        while idx < residuals.len() && spacing(from, idx).is_some_and(|px| px < lag_px) {
            idx += 1;
        }
        idx
    };
    let near_enough = |from: usize, idx: usize, lag_px: f64| {
        idx < residuals.len() && spacing(from, idx).is_some_and(|px| px < 1.5 * lag_px)
    };
    let (mut sum, mut n, mut middle, mut last) = (0.0, 0.0, 0, 0);
    for first in 0..residuals.len() {
        middle = beyond(first, middle.max(first + 1), lag_px);
        last = beyond(first, last.max(middle), 2.0 * lag_px);
        if near_enough(first, middle, lag_px) && near_enough(first, last, 2.0 * lag_px) {
            sum += (residuals[first] - 2.0 * residuals[middle] + residuals[last]).powi(2) / 6.0;
            n += 1.0;
        }
    }
    (n > 0.0).then(|| f64::sqrt(sum / n))
}

/// The width of the zone that holds 99.9 % of points with nothing but noise of this RMS, mm: of a mixture of normal
/// distributions whose σ are in proportion to those stated for the points.
fn noise_band_mm(samples: &Samples, inliers: &[u32], shape: &Shape, noise_mm: f64) -> f64 {
    let step = inliers.len().div_ceil(BAND_POINTS).max(1);
    let stated: Vec<f64> =
        inliers.iter().step_by(step).map(|&idx| samples.at(idx).normal_sigma_mm(shape)).collect();
    let rms = (stated.iter().map(|sigma| sigma * sigma).sum::<f64>() / stated.len().max(1) as f64).sqrt();
    let outside = |half: f64| {
        let tails = stated.iter().map(|sigma| erfc(half * rms / (sigma * std::f64::consts::SQRT_2)));
        tails.sum::<f64>() / stated.len() as f64
    };
    let (mut low, mut high) = (0.0, 4.0 * TAIL_QUANTILE);
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        if outside(middle) > 1.0 - FLATNESS_FRACTION { low = middle } else { high = middle }
    }
    2.0 * noise_mm * high
}

/// The noise of the points along the normal of a shape as stated for them, RMS, mm.
fn predicted_mm(samples: &Samples, inliers: &[u32], shape: &Shape) -> f64 {
    let squares = inliers.iter().map(|&idx| samples.at(idx).normal_sigma_mm(shape).powi(2));
    (squares.sum::<f64>() / inliers.len().max(1) as f64).sqrt()
}
