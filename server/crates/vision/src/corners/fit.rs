//! Fits the blurred-corner model to one window of pixels.
//!
//! I(u, v) = b₀ + b₁X + b₂Y + (a₀ + a₁X + a₂Y) · S, with S from [`model`](super::model) and X, Y the pixel
//! relative to the window's centre in units of its half-side: brightness and contrast may both slope.
//! Levenberg–Marquardt over the eleven parameters, Tukey weights around the expected noise.

use nalgebra::{SMatrix, SVector};

use super::model::{Cross, CrossShape};
use super::params::{BLUR_RANGE_PX, FIRST_STEP_TOLERANCE_PX, MAX_ITERATIONS, STEP_TOLERANCE_PX, TUKEY_SIGMAS};

/// u, v, two normals, blur, then the six linear grey-level parameters.
const N: usize = 11;
type Normal = SMatrix<f64, N, N>;
type Step = SVector<f64, N>;

/// Variance of the grey levels as a function of the grey level: read noise + shot noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseModel {
    /// Variance at grey level zero, extrapolated (levels²).
    pub offset: f64,
    /// Growth of the variance per grey level (levels).
    pub per_level: f64,
    /// Smallest variance anywhere (levels²).
    pub floor: f64,
}

impl NoiseModel {
    pub(super) fn variance(&self, level: f64) -> f64 {
        (self.offset + self.per_level * level).max(self.floor)
    }
}

/// The pixels one fit sees.
#[derive(Debug, Clone, Default)]
pub(super) struct Window {
    /// Pixel that the coordinates below are relative to.
    pub centre: [f64; 2],
    /// Half-side, the unit of the grey-level slopes (px).
    pub half_side_px: f64,
    /// Pixel offsets from `centre` and grey level.
    pub pixels: Vec<[f64; 3]>,
}

/// A fitted corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CornerFit {
    /// The crossing point (u, v) in the image.
    pub position_px: [f64; 2],
    /// Edges and blur.
    pub shape: CrossShape,
    /// Half the grey-level step between the squares, positive where the +column/+row square is bright.
    pub contrast: f64,
    /// Largest slope of brightness or contrast over the window's half-side, as a share of `contrast`.
    pub slope_ratio: f64,
    /// Root mean square of what the model leaves unexplained beyond pixel noise (levels).
    pub misfit_rms: f64,
    /// Standard deviation of the position per axis, from the normal equations and the noise model.
    pub sigma_px: f64,
}

struct State {
    position: [f64; 2],
    shape: CrossShape,
    levels: [f64; 6],
}

struct Sums {
    normal: Normal,
    gradient: Step,
    cost: f64,
    /// Sum of the weights.
    weight: f64,
    /// Sum of squared influences (weight × normalised residual).
    influence2: f64,
    /// Sum of the influences' derivatives.
    response: f64,
}

/// Fits the corner near `start_px`; `None` if the pixels do not determine it.
///
/// Without a noise model the fit is exploratory: plain least squares, ended early.
pub(super) fn fit_corner(
    window: &Window,
    start_px: [f64; 2],
    shape: CrossShape,
    noise: Option<&NoiseModel>,
) -> Option<CornerFit> {
    if window.pixels.len() < 2 * N {
        return None;
    }
    let position = [start_px[0] - window.centre[0], start_px[1] - window.centre[1]];
    let mut state = State { position, shape, levels: [0.0; 6] };
    let mut damping = 1e-3;
    solve_levels(window, &mut state)?;
    let mut sums = accumulate(window, &state, noise);
    let tolerance_px = if noise.is_some() { STEP_TOLERANCE_PX } else { FIRST_STEP_TOLERANCE_PX };
    for _ in 0..MAX_ITERATIONS {
        let mut damped = sums.normal;
        for k in 0..N {
            damped[(k, k)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&sums.gradient);
        let candidate = state.moved(&step);
        let candidate_sums = accumulate(window, &candidate, noise);
        let short = step[0].hypot(step[1]) < tolerance_px;
        if candidate_sums.cost <= sums.cost {
            (state, sums) = (candidate, candidate_sums);
            damping = (damping * 0.1).max(1e-9);
        } else {
            damping *= 10.0;
        }
        if short || damping > 1e6 {
            break;
        }
    }
    finished(window, &state, &sums)
}

impl State {
    fn moved(&self, step: &Step) -> Self {
        let mut shape = self.shape;
        for k in 0..2 {
            shape.normal_rad[k] += step[2 + k].clamp(-0.2, 0.2);
        }
        shape.blur_px = (shape.blur_px + step[4]).clamp(0.5 * shape.blur_px, 2.0 * shape.blur_px);
        shape.blur_px = shape.blur_px.clamp(BLUR_RANGE_PX.0, BLUR_RANGE_PX.1);
        let longest = 2.0 / step[0].hypot(step[1]).max(2.0);
        State {
            position: [self.position[0] + longest * step[0], self.position[1] + longest * step[1]],
            shape,
            levels: std::array::from_fn(|k| self.levels[k] + step[5 + k]),
        }
    }
}

/// The six grey-level parameters for the state's geometry: linear least squares.
fn solve_levels(window: &Window, state: &mut State) -> Option<()> {
    let cross = Cross::new(&state.shape);
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    let mut right = SVector::<f64, 6>::zeros();
    for &[x, y, level] in &window.pixels {
        let s = cross.at([x - state.position[0], y - state.position[1]]).value;
        let row = SVector::from(level_basis(x / window.half_side_px, y / window.half_side_px, s));
        normal += row * row.transpose();
        right += row * level;
    }
    state.levels = normal.cholesky()?.solve(&right).into();
    Some(())
}

fn level_basis(x: f64, y: f64, s: f64) -> [f64; 6] {
    [1.0, x, y, s, x * s, y * s]
}

/// Normal equations and robust cost at `state`.
fn accumulate(window: &Window, state: &State, noise: Option<&NoiseModel>) -> Sums {
    let cross = Cross::new(&state.shape);
    let mut sums = Sums {
        normal: Normal::zeros(),
        gradient: Step::zeros(),
        cost: 0.0,
        weight: 0.0,
        influence2: 0.0,
        response: 0.0,
    };
    let mut normal = [[0.0; N]; N];
    let mut gradient = [0.0; N];
    for &[x, y, level] in &window.pixels {
        let s = cross.at([x - state.position[0], y - state.position[1]]);
        let basis = level_basis(x / window.half_side_px, y / window.half_side_px, s.value);
        let contrast = state.levels[3] + state.levels[4] * basis[1] + state.levels[5] * basis[2];
        let expected: f64 = basis.iter().zip(&state.levels).map(|(b, l)| b * l).sum();
        let residual = level - expected;
        let Robust { variance, weight, loss, response } = robust(residual, expected, noise);
        let row = [
            contrast * s.by_position[0],
            contrast * s.by_position[1],
            contrast * s.by_normal[0],
            contrast * s.by_normal[1],
            contrast * s.by_blur,
            basis[0],
            basis[1],
            basis[2],
            basis[3],
            basis[4],
            basis[5],
        ];
        let scale = weight / variance;
        for i in 0..N {
            let weighted = scale * row[i];
            gradient[i] += weighted * residual;
            for j in i..N {
                normal[i][j] += weighted * row[j];
            }
        }
        sums.cost += loss;
        sums.weight += weight;
        sums.influence2 += weight * weight * residual * residual / variance;
        sums.response += response;
    }
    sums.normal = Normal::from_fn(|i, j| normal[i.min(j)][i.max(j)]);
    sums.gradient = Step::from(gradient);
    sums
}

/// What one residual contributes.
struct Robust {
    variance: f64,
    weight: f64,
    loss: f64,
    /// Derivative of the influence weight × residual.
    response: f64,
}

/// Tukey's bisquare; plain least squares without a noise model.
fn robust(residual: f64, expected: f64, noise: Option<&NoiseModel>) -> Robust {
    let Some(noise) = noise else {
        return Robust { variance: 1.0, weight: 1.0, loss: residual * residual, response: 1.0 };
    };
    let variance = noise.variance(expected);
    let limit = TUKEY_SIGMAS * TUKEY_SIGMAS;
    let t = residual * residual / (variance * limit);
    if t >= 1.0 {
        return Robust { variance, weight: 0.0, loss: limit / 3.0, response: 0.0 };
    }
    let keep = 1.0 - t;
    Robust {
        variance,
        weight: keep * keep,
        loss: limit / 3.0 * (1.0 - keep * keep * keep),
        response: keep * (1.0 - 5.0 * t),
    }
}

/// The result at the end of the iterations; its covariance is that of an M-estimator (Huber 1981, 7.6): the mean
/// squared influence over the squared mean response, times the inverse of the unweighted normal matrix.
fn finished(window: &Window, state: &State, sums: &Sums) -> Option<CornerFit> {
    let n = window.pixels.len() as f64;
    if sums.weight < 2.0 * N as f64 || sums.response <= 0.0 {
        return None;
    }
    let covariance = sums.normal.cholesky()?.inverse();
    let scatter = sums.influence2 / (n - N as f64) * (n / sums.response).powi(2);
    let variance = 0.5 * (covariance[(0, 0)] + covariance[(1, 1)]) * (sums.weight / n) * scatter;
    let fit = CornerFit {
        position_px: [window.centre[0] + state.position[0], window.centre[1] + state.position[1]],
        shape: state.shape,
        contrast: state.levels[3],
        slope_ratio: [1, 2, 4, 5]
            .map(|k| (state.levels[k] / state.levels[3]).abs())
            .into_iter()
            .fold(0.0, f64::max),
        misfit_rms: misfit_rms(window, state),
        sigma_px: variance.sqrt(),
    };
    (fit.sigma_px.is_finite() && fit.position_px.iter().all(|p| p.is_finite())).then_some(fit)
}

/// Residuals shared by neighbouring pixels: their mean square less half that of their differences, which white pixel
/// noise makes equal.
fn misfit_rms(window: &Window, state: &State) -> f64 {
    let residuals = residuals_at(window, state);
    let square = residuals.iter().map(|r| r[1] * r[1]).sum::<f64>() / residuals.len() as f64;
    let (mut noise, mut count) = (0.0, 0.0);
    for (pair, r) in window.pixels.windows(2).zip(residuals.windows(2)) {
        if pair[0][1] == pair[1][1] && pair[1][0] - pair[0][0] == 1.0 {
            noise += 0.5 * (r[1][1] - r[0][1]).powi(2);
            count += 1.0;
        }
    }
    (square - noise / f64::max(count, 1.0)).max(0.0).sqrt()
}

/// Grey level the fit expects at each pixel of the window, and the residual there.
pub(super) fn residuals(window: &Window, fit: &CornerFit) -> Vec<[f64; 2]> {
    let position = [fit.position_px[0] - window.centre[0], fit.position_px[1] - window.centre[1]];
    let mut state = State { position, shape: fit.shape, levels: [0.0; 6] };
    if solve_levels(window, &mut state).is_none() {
        return Vec::new();
    }
    residuals_at(window, &state)
}

fn residuals_at(window: &Window, state: &State) -> Vec<[f64; 2]> {
    let cross = Cross::new(&state.shape);
    let residual = |&[x, y, level]: &[f64; 3]| {
        let s = cross.at([x - state.position[0], y - state.position[1]]).value;
        let basis = level_basis(x / window.half_side_px, y / window.half_side_px, s);
        let expected: f64 = basis.iter().zip(&state.levels).map(|(b, l)| b * l).sum();
        [expected, level - expected]
    };
    window.pixels.iter().map(residual).collect()
}
