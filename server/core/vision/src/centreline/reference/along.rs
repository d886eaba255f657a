//! Averaging along the line: a weighted local parabola, as long as the line agrees with one.
//!
//! Noise falls with the length of the window, and a parabola keeps curves where they are. Where a longer window
//! contradicts a shorter one by more than their noise, the line has detail there and the shorter one holds
//! (after Lepski 1991: the largest bandwidth that is consistent with all smaller ones).

use super::crossing::Crossing;
use super::scatter::Scatter;
use crate::params::{
    ALONG_AGREEMENT_SIGMAS, ALONG_HALF_LENGTH_WIDTHS, ALONG_MAX_HALF_LENGTH, ALONG_MIN_HALF_LENGTH, SKEW_DOUBT,
};

/// Farthest lag, in columns, at which noise is still taken as shared.
const MAX_LAG: usize = 8;

/// The line at one column.
#[derive(Debug, Clone, Copy)]
pub struct Averaged {
    /// Row.
    pub v: f64,
    /// Rows per column.
    pub slope: f64,
    /// Variance of `v`, px².
    pub variance: f64,
}

/// Fits local parabolas along lines.
pub struct Averager {
    half_lengths: Vec<usize>,
    correlations: [f64; MAX_LAG + 1],
    correlation_px: f64,
    along_variance_px2: f64,
}

/// A line ready for fitting.
struct Weighted<'a> {
    line: &'a [Crossing],
    variances: Vec<f64>,
}

impl Averager {
    /// An averager for lines of a typical width (full, at half height). `along_variance_px2` is the variance of
    /// the Gaussian that smoothed along the line before; it displaces curves by half the curvature times itself,
    /// and that is taken back.
    pub fn new(width_px: f32, scatter: &Scatter, along_variance_px2: f64) -> Self {
        let longest = (ALONG_HALF_LENGTH_WIDTHS * width_px).round() as usize;
        let longest = longest.clamp(2 * ALONG_MIN_HALF_LENGTH, ALONG_MAX_HALF_LENGTH);
        let mut half_lengths = vec![longest];
        while half_lengths[half_lengths.len() - 1] >= 2 * ALONG_MIN_HALF_LENGTH {
            half_lengths.push(half_lengths[half_lengths.len() - 1] / 2);
        }
        half_lengths.reverse();
        let correlations = std::array::from_fn(|lag| scatter.correlation(lag));
        Self { half_lengths, correlations, correlation_px: scatter.correlation_px(), along_variance_px2 }
    }

    /// The averaged line at every crossing of `line` (neighbouring columns, no gaps).
    pub fn average(&self, line: &[Crossing], scatter: &Scatter) -> Vec<Averaged> {
        let variances = line.iter().map(|c| scatter.variance(c).max(1e-8)).collect();
        let weighted = Weighted { line, variances };
        let mut kernel = Vec::with_capacity(2 * ALONG_MAX_HALF_LENGTH + 1);
        (0..line.len()).map(|idx| self.at(&weighted, idx, &mut kernel)).collect()
    }

    fn at(&self, weighted: &Weighted, idx: usize, kernel: &mut Vec<f64>) -> Averaged {
        let raw = Averaged { v: weighted.line[idx].v, slope: 0.0, variance: weighted.variances[idx] };
        let mut best: Option<Averaged> = None;
        for &half_length in &self.half_lengths {
            let Some(fitted) = self.fit(weighted, idx, half_length, kernel) else { continue };
            if let Some(shorter) = best {
                let noise = (shorter.variance - fitted.variance).max(0.1 * shorter.variance).sqrt();
                if (fitted.v - shorter.v).abs() > ALONG_AGREEMENT_SIGMAS * noise {
                    break;
                }
            }
            best = Some(fitted);
        }
        best.unwrap_or(raw)
    }

    /// Weighted parabola over `idx ± half_length`; weights are inverse variances times a taper.
    fn fit(&self, weighted: &Weighted, idx: usize, half_length: usize, kernel: &mut Vec<f64>) -> Option<Averaged> {
        let from = idx.saturating_sub(half_length);
        let to = (idx + half_length + 1).min(weighted.line.len());
        let reach = (half_length + 1) as f64;
        let at = |k: usize| k as f64 - idx as f64;
        kernel.clear();
        let mut s = [0.0f64; 5];
        for k in from..to {
            let x = at(k);
            let weight = (1.0 - (x / reach) * (x / reach)) / weighted.variances[k];
            let (wx, wxx) = (weight * x, weight * x * x);
            s[0] += weight;
            s[1] += wx;
            s[2] += wxx;
            s[3] += wxx * x;
            s[4] += wxx * x * x;
            kernel.push(weight);
        }
        let [value, slope, bend] = inverse_rows(&s)?;
        // The value at the middle, with the displacement of a parabola by the earlier smoothing taken off.
        let value: [f64; 3] = std::array::from_fn(|i| value[i] - self.along_variance_px2 * bend[i]);
        let (mut v, mut lean, mut curl) = (0.0, 0.0, 0.0);
        let base = weighted.line[idx].v;
        for (k, h) in (from..to).zip(kernel.iter_mut()) {
            let (x, y) = (at(k), weighted.line[k].v - base);
            let weight = *h;
            *h = weight * (value[0] + x * (value[1] + x * value[2]));
            v += *h * y;
            lean += weight * (slope[0] + x * (slope[1] + x * slope[2])) * y;
            curl += weight * (bend[0] + x * (bend[1] + x * bend[2])) * y;
        }
        let variance = self.variance_of(kernel, &weighted.variances[from..to]);
        let bend_variance = bend[2] * self.correlation_px;
        let sure = (1.0 - f64::from(SKEW_DOUBT) * bend_variance / (curl * curl)).max(0.0);
        let skew = sure * skew_shift(lean, 2.0 * curl, weighted.line[idx].cross_variance_px2);
        Some(Averaged { v: base + v - skew, slope: lean, variance })
    }

    /// Variance of Σ h v with correlated noise.
    fn variance_of(&self, kernel: &mut [f64], variances: &[f64]) -> f64 {
        kernel.iter_mut().zip(variances).for_each(|(h, var)| *h *= var.sqrt());
        let mut sum: f64 = kernel.iter().map(|h| h * h).sum();
        for lag in 1..=MAX_LAG.min(kernel.len() - 1) {
            let products: f64 = kernel.iter().zip(&kernel[lag..]).map(|(a, b)| a * b).sum();
            sum += 2.0 * self.correlations[lag] * products;
        }
        sum.max(1e-10)
    }
}

/// How far (rows) the centre of a column's profile lies from a line that is steep and curved at once.
///
/// The column cuts such a line's bell at an angle, and its two flanks at different angles: to first order in the
/// curvature v'' the centre moves by 3/2 · v'' · m² / (1 + m²)² · s², m the slope and s² the variance along the
/// column of profile times window.
fn skew_shift(slope: f64, curvature: f64, cross_variance_px2: f64) -> f64 {
    let steep = slope * slope;
    1.5 * curvature * steep / ((1.0 + steep) * (1.0 + steep)) * cross_variance_px2
}

/// A parabola through weighted points.
pub struct Parabola {
    coefficients: [f64; 3],
    covariance: [[f64; 3]; 3],
}

impl Parabola {
    /// Value at `x` and its variance, were the points' errors independent with variance 1 / weight.
    pub fn at(&self, x: f64) -> (f64, f64) {
        let powers = [1.0, x, x * x];
        let value = (0..3).map(|i| self.coefficients[i] * powers[i]).sum();
        let variance =
            (0..3).map(|i| (0..3).map(|j| powers[i] * self.covariance[i][j] * powers[j]).sum::<f64>()).sum();
        (value, variance)
    }
}

/// Fits a parabola to (x, y, weight) by least squares; `None` with fewer than three different x.
pub fn parabola(points: impl Iterator<Item = (f64, f64, f64)>) -> Option<Parabola> {
    let (mut s, mut t) = ([0.0f64; 5], [0.0f64; 3]);
    for (x, y, weight) in points {
        let mut moment = weight;
        for k in 0..5 {
            s[k] += moment;
            if k < 3 {
                t[k] += moment * y;
            }
            moment *= x;
        }
    }
    let covariance = inverse_rows(&s)?;
    let coefficients = covariance.map(|row| (0..3).map(|j| row[j] * t[j]).sum());
    Some(Parabola { coefficients, covariance })
}

/// Rows of the inverse of the normal matrix of a parabola with moments `s`; `None` if it is singular.
fn inverse_rows(s: &[f64; 5]) -> Option<[[f64; 3]; 3]> {
    let cofactors = [
        [s[2] * s[4] - s[3] * s[3], s[2] * s[3] - s[1] * s[4], s[1] * s[3] - s[2] * s[2]],
        [s[2] * s[3] - s[1] * s[4], s[0] * s[4] - s[2] * s[2], s[1] * s[2] - s[0] * s[3]],
        [s[1] * s[3] - s[2] * s[2], s[1] * s[2] - s[0] * s[3], s[0] * s[2] - s[1] * s[1]],
    ];
    let determinant = s[0] * cofactors[0][0] + s[1] * cofactors[0][1] + s[2] * cofactors[0][2];
    (determinant > 1e-9 * s[0] * s[2] * s[4]).then(|| cofactors.map(|row| row.map(|c| c / determinant)))
}
