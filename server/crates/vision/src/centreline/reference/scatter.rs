//! How large the noise of the crossings is: camera noise is predicted, speckle is measured on the crossings
//! themselves.
//!
//! The variance of a crossing is modelled as camera + speckle² · c, both propagated through the weights that made
//! it (see [`Crossing`]); the one factor c (contrast² × grain) belongs to the surface and the lens and is found
//! from third differences at a lag beyond the grain, which any parabola passes unnoticed.

use super::crossing::Crossing;
use crate::params::{
    SCATTER_CLIP, SCATTER_LAG, SCATTER_MAX_SAMPLES, SCATTER_MIN_SAMPLES, SCATTER_SHORT_LAG, SPECKLE_PRIOR,
};

/// Mean of min(χ²₁, 9), what [`SCATTER_CLIP`] leaves of a unit Gaussian's square.
const CLIPPED_MEAN: f64 = 0.995;
/// Coefficients of the third difference.
const THIRD: [f64; 4] = [1.0, -3.0, 3.0, -1.0];

/// The noise of an image's crossings.
#[derive(Debug, Clone, Copy)]
pub struct Scatter {
    /// Squared speckle contrast times grain, px.
    speckle: f64,
    /// ρ(k) = exp(−k² / 4ℓ²): ℓ in columns.
    grain_px: f64,
}

/// A third difference with what the model predicts for it, were neighbours independent.
#[derive(Clone, Copy)]
struct Sample {
    square: f64,
    camera: f64,
    speckle: f64,
}

impl Scatter {
    /// Measures the scatter. `grain_min_px` is the smoothing along the line that made the crossings.
    pub fn measure(lines: &[Vec<Crossing>], grain_min_px: f64) -> Self {
        let (long, short) = (samples(lines, SCATTER_LAG), samples(lines, SCATTER_SHORT_LAG));
        let prior = Self { speckle: SPECKLE_PRIOR, grain_px: grain_min_px.max(0.5) };
        if long.len() < SCATTER_MIN_SAMPLES {
            return prior;
        }
        let apparent = fit_speckle(&long, 1.0);
        let scale = |sample: &Sample| sample.square / (sample.camera + apparent * sample.speckle);
        let ratio = clipped_scale(short.iter().map(scale)) / clipped_scale(long.iter().map(scale)).max(1e-9);
        let grain_px = grain_of_ratio(ratio, grain_min_px.max(0.5));
        Self { speckle: fit_speckle(&long, third_difference_gain(SCATTER_LAG, grain_px)), grain_px }
    }

    /// Variance (px²) of one crossing along its column.
    pub fn variance(&self, crossing: &Crossing) -> f64 {
        crossing.camera_variance + self.speckle * crossing.speckle_variance
    }

    /// Correlation of the noise of two crossings `columns` apart.
    pub fn correlation(&self, columns: usize) -> f64 {
        (-((columns * columns) as f64) / (4.0 * self.grain_px * self.grain_px)).exp()
    }

    /// Σ ρ over all lags: columns per independent crossing.
    pub fn correlation_px(&self) -> f64 {
        (1.0 + 2.0 * (1..32).map(|k| self.correlation(k)).sum::<f64>()).max(1.0)
    }
}

/// Third differences of all lines, thinned evenly to at most [`SCATTER_MAX_SAMPLES`].
fn samples(lines: &[Vec<Crossing>], lag: usize) -> Vec<Sample> {
    let span = 3 * lag;
    let available: usize = lines.iter().map(|l| l.len().saturating_sub(span)).sum();
    let stride = available.div_ceil(SCATTER_MAX_SAMPLES).max(1);
    let mut found = Vec::with_capacity(available / stride + lines.len());
    for line in lines {
        for start in (0..line.len().saturating_sub(span)).step_by(stride) {
            let mut difference = 0.0;
            let mut sample = Sample { square: 0.0, camera: 0.0, speckle: 0.0 };
            for (k, c) in THIRD.iter().enumerate() {
                let crossing = &line[start + k * lag];
                difference += c * crossing.v;
                sample.camera += c * c * crossing.camera_variance;
                sample.speckle += c * c * crossing.speckle_variance;
            }
            sample.square = difference * difference;
            found.push(sample);
        }
    }
    found
}

/// The speckle factor for which the clipped mean of the normalised squares is that of a unit Gaussian; zero if
/// the camera noise explains them all.
fn fit_speckle(samples: &[Sample], gain: f64) -> f64 {
    let excess = |speckle: f64| {
        let normalised = |s: &Sample| (s.square / (gain * (s.camera + speckle * s.speckle))).min(SCATTER_CLIP);
        samples.iter().map(normalised).sum::<f64>() / samples.len() as f64 - CLIPPED_MEAN
    };
    let (mut low, mut high) = (1e-5f64.ln(), 1e2f64.ln());
    if excess(low.exp()) <= 0.0 {
        return 0.0;
    }
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if excess(middle.exp()) > 0.0 { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).exp()
}

/// The factor by which squares exceed unit Gaussian ones, clipped alike.
fn clipped_scale(squares: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = squares.collect();
    let n = squares.len().max(1) as f64;
    let (mut low, mut high) = (1e-4f64, 1e2f64);
    for _ in 0..24 {
        let middle = (low * high).sqrt();
        let mean = squares.iter().map(|s| (s / middle).min(SCATTER_CLIP)).sum::<f64>() / n;
        if mean > CLIPPED_MEAN { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

/// Variance of a third difference at `lag` relative to independent noise, for ρ(k) = exp(−k² / 4ℓ²).
fn third_difference_gain(lag: usize, grain_px: f64) -> f64 {
    let rho = |steps: usize| (-((steps * lag * steps * lag) as f64) / (4.0 * grain_px * grain_px)).exp();
    (20.0 - 30.0 * rho(1) + 12.0 * rho(2) - 2.0 * rho(3)) / 20.0
}

/// The grain at which the short lag shows `ratio` of the long lag's variance.
fn grain_of_ratio(ratio: f64, grain_min_px: f64) -> f64 {
    let (mut low, mut high) = (grain_min_px, 3.0);
    let predicted =
        |grain: f64| third_difference_gain(SCATTER_SHORT_LAG, grain) / third_difference_gain(SCATTER_LAG, grain);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if predicted(middle) > ratio { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
