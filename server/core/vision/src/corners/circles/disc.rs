//! A blurred ellipse fitted to the image of a disc.
//!
//! With g = |A(x − c)|, the rim is g = 1 and d = (g − 1)/|∇g| the distance from it near the rim; the model is I = b₀ +
//! b₁X + b₂Y + a·erf(d/√2σ). Only pixels near the rim are used. The model's errors, from the blur of a curved edge and
//! from the first-order distance, are symmetric about the centre: they affect the ellipse's size, not its centre.

use nalgebra::{Matrix2, SMatrix, SVector, SymmetricEigen, Vector2};

use crate::GreyImage;
use crate::corners::erf_and_gauss;

use super::super::params::{
    DISC_BAND_PX, DISC_GAP_FRACTION, DISC_MAX_ITERATIONS, DISC_MAX_RESIDUAL_RATIO, DISC_MAX_SHIFT_PX,
    STEP_TOLERANCE_PX, TUKEY_SIGMAS, first_damping,
};
use super::blobs::Blob;

/// Parameters: u, v, three of the symmetric matrix A, blur, brightness with two slopes, half the contrast.
const N: usize = 10;
type Params = SVector<f64, N>;

/// A fitted disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Disc {
    /// Centre of the ellipse.
    pub centre_px: [f64; 2],
    /// Standard deviation of the centre per axis.
    pub sigma_px: f64,
    /// Area of the ellipse.
    pub area_px2: f64,
}

/// A pixel near the rim.
struct Sample {
    at: [f64; 2],
    level: f64,
}

/// Fits a disc to `blob`, whose nearest neighbour is `nearest_px` away. `None` if the blob is not a disc.
pub(super) fn fit_disc(image: &GreyImage, blob: &Blob, nearest_px: f64) -> Option<Disc> {
    let [uu, uv, vv] = blob.spread_px2;
    // The variance of a filled ellipse along a semi-axis is a quarter of its square.
    let axes = SymmetricEigen::new(4.0 * Matrix2::new(uu, uv, uv, vv));
    let radii = axes.eigenvalues.map(f64::sqrt);
    let shape =
        axes.eigenvectors * Matrix2::from_diagonal(&radii.map(|r| 1.0 / r)) * axes.eigenvectors.transpose();
    let longest_px = radii.max();
    let band_px = DISC_BAND_PX.min(DISC_GAP_FRACTION * (nearest_px - 2.0 * longest_px)).max(1.5);
    let unit_px = longest_px + band_px;
    let samples = samples(image, blob.centre_px, &shape, band_px, unit_px)?;
    let mut state = Params::zeros();
    (state[2], state[3], state[4], state[5]) = (shape[(0, 0)], shape[(0, 1)], shape[(1, 1)], 1.0);
    let mut levels: Vec<f64> = samples.iter().map(|sample| sample.level).collect();
    levels.sort_by(f64::total_cmp);
    let (low, high) = (levels[levels.len() / 10], levels[levels.len() - 1 - levels.len() / 10]);
    let inside = image.at(blob.centre_px[0].round() as usize, blob.centre_px[1].round() as usize);
    state[6] = 0.5 * (low + high);
    state[9] = 0.5 * (high - low) * if f64::from(inside) < state[6] { 1.0 } else { -1.0 };
    let fit = solve(&samples, state, unit_px)?;
    let moved_px = fit.state[0].hypot(fit.state[1]);
    let is_disc = fit.residual_rms < DISC_MAX_RESIDUAL_RATIO * fit.state[9].abs() && moved_px < DISC_MAX_SHIFT_PX;
    let determinant = fit.state[2] * fit.state[4] - fit.state[3] * fit.state[3];
    (is_disc && determinant > 0.0).then(|| Disc {
        centre_px: [blob.centre_px[0] + fit.state[0], blob.centre_px[1] + fit.state[1]],
        sigma_px: fit.variance.sqrt(),
        area_px2: std::f64::consts::PI / determinant,
    })
}

/// Pixels within `band_px` of the rim, relative to `centre_px`; `None` if too few.
fn samples(
    image: &GreyImage,
    centre_px: [f64; 2],
    shape: &Matrix2<f64>,
    band_px: f64,
    reach_px: f64,
) -> Option<Vec<Sample>> {
    let range = |k: usize, side: usize| {
        let first = (centre_px[k] - reach_px).ceil().max(0.0) as usize;
        first..((centre_px[k] + reach_px).floor().max(0.0) as usize + 1).min(side)
    };
    let mut samples = Vec::new();
    for v in range(1, image.height()) {
        for u in range(0, image.width()) {
            let at = [u as f64 - centre_px[0], v as f64 - centre_px[1]];
            if rim(shape, at).distance_px.abs() <= band_px {
                samples.push(Sample { at, level: f64::from(image.at(u, v)) });
            }
        }
    }
    (samples.len() > 2 * N).then_some(samples)
}

/// Position of a pixel relative to the rim.
struct Rim {
    distance_px: f64,
    /// Unit vector A(x − c)/g, and A times it over |∇g|: the outward normal.
    unit: Vector2<f64>,
    normal: Vector2<f64>,
    gradient: f64,
}

fn rim(shape: &Matrix2<f64>, at: [f64; 2]) -> Rim {
    let mapped = shape * Vector2::new(at[0], at[1]);
    let g = mapped.norm().max(1e-9);
    let unit = mapped / g;
    let slope = shape * unit;
    let gradient = slope.norm().max(1e-9);
    Rim { distance_px: (g - 1.0) / gradient, unit, normal: slope / gradient, gradient }
}

struct Fit {
    state: Params,
    /// Variance of the centre per axis (px²).
    variance: f64,
    /// RMS of the residuals (levels).
    residual_rms: f64,
}

/// Normal equations at a state.
struct Sums {
    normal: SMatrix<f64, N, N>,
    gradient: Params,
    cost: f64,
    weight: f64,
    /// Weighted and plain sums of the squared residuals.
    squares: [f64; 2],
}

fn solve(samples: &[Sample], start: Params, unit_px: f64) -> Option<Fit> {
    let mut state = start;
    let mut damping = first_damping();
    // Least squares first; then residuals beyond the limit get weight zero.
    let mut limit = f64::INFINITY;
    let mut sums = sums(samples, &state, unit_px, limit);
    for iteration in 0..DISC_MAX_ITERATIONS {
        let mut damped = sums.normal;
        for k in 0..N {
            damped[(k, k)] *= 1.0 + damping.value();
        }
        let step = damped.cholesky()?.solve(&sums.gradient);
        let mut candidate = state + step;
        candidate[5] = candidate[5].clamp(0.5 * state[5], 2.0 * state[5]).clamp(0.25, 10.0);
        let next = self::sums(samples, &candidate, unit_px, limit);
        let short = step[0].hypot(step[1]) < STEP_TOLERANCE_PX;
        let is_in_range = if next.cost <= sums.cost {
            (state, sums) = (candidate, next);
            damping.decrease();
            true
        } else {
            damping.increase()
        };
        if short || !is_in_range {
            if limit.is_finite() {
                break;
            }
            let degrees = (samples.len() - N) as f64;
            limit = TUKEY_SIGMAS * (sums.squares[1] / degrees).sqrt().max(0.3);
            sums = self::sums(samples, &state, unit_px, limit);
            damping = first_damping();
        }
        if iteration + 1 == DISC_MAX_ITERATIONS {
            return None;
        }
    }
    let covariance = sums.normal.cholesky()?.inverse();
    let noise = sums.squares[0] / (sums.weight - N as f64).max(1.0);
    let variance = 0.5 * (covariance[(0, 0)] + covariance[(1, 1)]) * noise.max(1.0 / 12.0);
    let residual_rms = (sums.squares[1] / samples.len() as f64).sqrt();
    (variance.is_finite() && variance > 0.0).then_some(Fit { state, variance, residual_rms })
}

fn sums(samples: &[Sample], state: &Params, unit_px: f64, limit: f64) -> Sums {
    let shape = Matrix2::new(state[2], state[3], state[3], state[4]);
    let (blur_px, contrast) = (state[5], state[9]);
    let mut sums =
        Sums { normal: SMatrix::zeros(), gradient: Params::zeros(), cost: 0.0, weight: 0.0, squares: [0.0; 2] };
    for sample in samples {
        let at = [sample.at[0] - state[0], sample.at[1] - state[1]];
        let rim = rim(&shape, at);
        let z = rim.distance_px / blur_px;
        let (profile, gauss) = erf_and_gauss(z);
        // dI/dd, and d by A: unit·(dA x) over the gradient.
        let by_d = contrast * 2.0 * gauss / ((2.0 * std::f64::consts::PI).sqrt() * blur_px);
        let by_shape = by_d / rim.gradient;
        let [x, y] = [sample.at[0] / unit_px, sample.at[1] / unit_px];
        let row = Params::from_column_slice(&[
            -by_d * rim.normal.x,
            -by_d * rim.normal.y,
            by_shape * rim.unit.x * at[0],
            by_shape * (rim.unit.x * at[1] + rim.unit.y * at[0]),
            by_shape * rim.unit.y * at[1],
            -by_d * z,
            1.0,
            x,
            y,
            profile,
        ]);
        let residual = sample.level - state[6] - state[7] * x - state[8] * y - contrast * profile;
        let t = (residual / limit).powi(2);
        let keep = (1.0 - t).max(0.0);
        let weight = keep * keep;
        sums.normal += row * row.transpose() * weight;
        sums.gradient += row * (weight * residual);
        sums.cost +=
            if limit.is_finite() { limit * limit / 3.0 * (1.0 - keep * keep * keep) } else { residual * residual };
        sums.weight += weight;
        sums.squares[0] += weight * residual * residual;
        sums.squares[1] += residual * residual;
    }
    sums
}
