//! Fits the blurred-corner model to one window of pixels.
//!
//! I(u, v) = b₀ + b₁X + b₂Y + (a₀ + a₁X + a₂Y) · S, with S from [`model`](super::model) and X, Y the pixel relative to
//! the window's centre in units of its half-side: brightness and contrast may both vary linearly. Levenberg–Marquardt
//! over the eleven parameters, Tukey weights around the expected noise.

use nalgebra::{SMatrix, SVector};

use super::model::CrossShape;
use super::sums::{BLOCK, CornerState, LEVELS, Sums, accumulate, accumulate_levels, expected_levels};
use crate::corners::params::{
    BLUR_RANGE_PX, FIRST_STEP_TOLERANCE_PX, MAX_ITERATIONS, MAX_STRETCH, SAME_SLOPES_STEP_PX, STEP_TOLERANCE_PX,
    first_damping,
};

/// u, v, two normals, blur, then the six linear grey-level parameters.
pub const N: usize = 11;
type Normal = SMatrix<f64, N, N>;
type Step = SVector<f64, N>;

/// Variance of the grey levels as a function of the grey level: read noise + shot noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// Variance at grey level zero, extrapolated (levels²).
    pub offset: f64,
    /// Growth of the variance per grey level (levels).
    pub per_level: f64,
    /// Smallest variance anywhere (levels²).
    pub floor: f64,
}

/// The pixels of one fit, row by row, padded to whole blocks of [`BLOCK`] with pixels of zero weight.
#[derive(Debug, Clone, Default)]
pub struct Window {
    /// Pixel to which the coordinates below are relative.
    pub centre: [f64; 2],
    /// Half-side, the unit of the grey-level slopes (px).
    pub half_side_px: f64,
    /// Columns relative to the centre.
    pub x: Vec<f32>,
    /// Rows relative to the centre.
    pub y: Vec<f32>,
    /// Grey levels.
    pub level: Vec<f32>,
    /// 1 for a pixel, 0 for padding.
    pub present: Vec<f32>,
    n_pixels: usize,
}

impl Window {
    /// An empty window with room for `capacity` pixels.
    pub fn new(centre: [f64; 2], half_side_px: f64, capacity: usize) -> Self {
        let room = || Vec::with_capacity(capacity.next_multiple_of(BLOCK));
        Self { centre, half_side_px, x: room(), y: room(), level: room(), present: room(), n_pixels: 0 }
    }

    /// Adds neighbouring pixels of a row, the first at (`x`, `y`) relative to the centre.
    pub fn push_run<T: Copy + Into<f32>>(&mut self, x: f32, y: f32, levels: &[T]) {
        self.x.extend((0..levels.len() as i32).map(|k| x + k as f32));
        self.y.extend(std::iter::repeat_n(y, levels.len()));
        self.level.extend(levels.iter().map(|&level| level.into()));
    }

    /// The window with its last block padded.
    pub fn padded(mut self) -> Self {
        self.n_pixels = self.level.len();
        self.present.resize(self.n_pixels, 1.0);
        for values in [&mut self.x, &mut self.y, &mut self.level, &mut self.present] {
            values.resize(self.n_pixels.next_multiple_of(BLOCK), 0.0);
        }
        self
    }

    /// Number of pixels, without the padding.
    pub fn n_pixels(&self) -> usize {
        self.n_pixels
    }
}

/// A fitted corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerFit {
    /// The crossing point (u, v) in the image.
    pub position_px: [f64; 2],
    /// Edges and blur.
    pub shape: CrossShape,
    /// Half the grey-level step between the squares, positive where the +column/+row square is bright.
    pub contrast: f64,
    /// Largest slope of brightness or contrast over the window's half-side, relative to `contrast`.
    pub slope_ratio: f64,
    /// RMS residual of the model beyond pixel noise (levels); 0 after a refinement.
    pub residual_rms: f64,
    /// Standard deviation of the position per axis, from the normal equations and the noise model.
    pub sigma_px: f64,
}

/// Initial state of a fit: the crossing at `start_px`, with the grey levels that fit it best; `None` if the pixels do
/// not determine them.
pub fn start_at(window: &Window, start_px: [f64; 2], shape: CrossShape) -> Option<CornerState> {
    if window.n_pixels() < 2 * N {
        return None;
    }
    let position = [start_px[0] - window.centre[0], start_px[1] - window.centre[1]];
    let mut state = CornerState { position, shape, levels: [0.0; LEVELS] };
    solve_levels(window, &mut state)?;
    Some(state)
}

/// Fits the corner near `start`; `None` if the pixels do not determine it.
///
/// Without a noise model the fit is exploratory: plain least squares, ended early.
pub fn fit_corner(window: &Window, start: CornerState, noise: Option<&NoiseModel>) -> Option<CornerFit> {
    let mut state = start;
    let mut damping = first_damping();
    let mut sums = accumulate(window, &state, noise, None);
    let tolerance_px = if noise.is_some() { STEP_TOLERANCE_PX } else { FIRST_STEP_TOLERANCE_PX };
    for _ in 0..MAX_ITERATIONS {
        let mut damped = normal_matrix(&sums);
        for k in 0..N {
            damped[(k, k)] *= 1.0 + damping.value();
        }
        let step = damped.cholesky()?.solve(&Step::from(sums.gradient)) * stretch(&sums);
        let candidate = moved(&state, &step);
        // The last step is applied without re-evaluation: its effect on the sums is far below their noise.
        if step[0].hypot(step[1]) < tolerance_px {
            state = candidate;
            break;
        }
        let short = step[0].hypot(step[1]).max(step[4].abs()) < SAME_SLOPES_STEP_PX;
        let candidate_sums = accumulate(window, &candidate, noise, short.then_some(&sums.normal));
        if candidate_sums.cost <= sums.cost {
            (state, sums) = (candidate, candidate_sums);
            damping.decrease();
        } else if !damping.increase() {
            break;
        }
    }
    finished(window, &state, &sums, noise.is_none())
}

/// Ratio of the step to the M-estimator's minimum to a step of reweighted least squares: the latter's normal matrix has
/// the weights in place of the derivatives of the influences (Huber 1981, 7.8).
fn stretch(sums: &Sums) -> f64 {
    if sums.response > 0.0 { (sums.weight / sums.response).clamp(1.0, MAX_STRETCH) } else { 1.0 }
}

fn normal_matrix(sums: &Sums) -> Normal {
    Normal::from_fn(|i, j| sums.normal[i][j])
}

fn moved(state: &CornerState, step: &Step) -> CornerState {
    let mut shape = state.shape;
    for k in 0..2 {
        shape.normal_rad[k] += step[2 + k].clamp(-0.2, 0.2);
    }
    shape.blur_px = (shape.blur_px + step[4]).clamp(0.5 * shape.blur_px, 2.0 * shape.blur_px);
    shape.blur_px = shape.blur_px.clamp(BLUR_RANGE_PX.0, BLUR_RANGE_PX.1);
    let longest = 2.0 / step[0].hypot(step[1]).max(2.0);
    CornerState {
        position: [state.position[0] + longest * step[0], state.position[1] + longest * step[1]],
        shape,
        levels: std::array::from_fn(|k| state.levels[k] + step[5 + k]),
    }
}

/// The six grey-level parameters for the state's geometry, by linear least squares.
fn solve_levels(window: &Window, state: &mut CornerState) -> Option<()> {
    let (normal, right) = accumulate_levels(window, state);
    let normal = SMatrix::<f64, LEVELS, LEVELS>::from_fn(|i, j| normal[i][j]);
    state.levels = normal.cholesky()?.solve(&SVector::from(right)).into();
    Some(())
}

/// The result after the last iteration; its covariance is that of an M-estimator (Huber 1981, 7.6): the mean squared
/// influence over the squared mean response, times the inverse of the unweighted normal matrix.
fn finished(window: &Window, state: &CornerState, sums: &Sums, exploratory: bool) -> Option<CornerFit> {
    let n = window.n_pixels() as f64;
    if sums.weight < 2.0 * N as f64 || sums.response <= 0.0 {
        return None;
    }
    let covariance = normal_matrix(sums).cholesky()?.inverse();
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
        residual_rms: if exploratory { residual_rms(window, state) } else { 0.0 },
        sigma_px: variance.sqrt(),
    };
    (fit.sigma_px.is_finite() && fit.position_px.iter().all(|p| p.is_finite())).then_some(fit)
}

/// The correlated part of the residuals: their mean square minus half that of the differences of neighbours, which are
/// equal for white pixel noise.
fn residual_rms(window: &Window, state: &CornerState) -> f64 {
    let expected = expected_levels(window, state);
    let residuals: Vec<f32> = window.level.iter().zip(&expected).map(|(level, e)| level - e).collect();
    let (mut square, mut noise, mut count) = (0.0f32, 0.0f32, 0.0f32);
    for k in 0..residuals.len() {
        square += residuals[k] * residuals[k];
        if k > 0 && window.y[k] == window.y[k - 1] && window.x[k] - window.x[k - 1] == 1.0 {
            noise += 0.5 * (residuals[k] - residuals[k - 1]).powi(2);
            count += 1.0;
        }
    }
    f64::from((square / residuals.len() as f32 - noise / count.max(1.0)).max(0.0).sqrt())
}

/// Grey level predicted by `state` at every `step`-th pixel of the window, and the residual there.
pub fn residuals(window: &Window, state: &CornerState, step: usize) -> Vec<[f32; 2]> {
    let expected = expected_levels(window, state);
    expected.iter().zip(&window.level).step_by(step).map(|(&e, level)| [e, level - e]).collect()
}
