//! The sums of a corner fit over the pixels of its window, in single precision and several pixels at a time.
//!
//! Each sum is eight interleaved partial sums that are added up in a fixed order, without fused multiply-add: the
//! result is bit-identical for every instruction set. The straightforward version in double precision is the tests'
//! `reference`.

// Several rows of a block are filled together by a shared index.
#![allow(clippy::needless_range_loop)]

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI, LN_2, LOG2_E, PI};

use multiversion::multiversion;

use super::fit::{N, NoiseModel, Window};
use super::model::CrossShape;
use crate::corners::params::TUKEY_SIGMAS;

/// Pixels of one pass: the rows of the Jacobian then fit in the L1 cache.
pub const BLOCK: usize = 64;

/// Partial sums of each sum.
const LANES: usize = 8;

/// Grey-level parameters: brightness and contrast, each with two slopes.
pub const LEVELS: usize = 6;

/// Entries on and above the diagonal of the normal matrix.
const PAIRS: usize = N * (N + 1) / 2;

type Lanes = [f32; LANES];
type Pixels = [f32; BLOCK];

/// Crossing point (relative to the window's centre), edges, grey levels: everything a residual depends on.
#[derive(Debug, Clone, Copy)]
pub struct CornerState {
    /// u, v relative to the window's centre (px).
    pub position: [f64; 2],
    /// Edges and blur.
    pub shape: CrossShape,
    /// b₀, b₁, b₂, a₀, a₁, a₂.
    pub levels: [f64; LEVELS],
}

/// Normal equations of the eleven parameters, and the sums for the covariance.
#[derive(Debug, Clone)]
pub struct Sums {
    /// Both triangles.
    pub normal: [[f64; N]; N],
    /// Jacobian times weighted residual.
    pub gradient: [f64; N],
    /// Robust cost.
    pub cost: f64,
    /// Sum of the weights.
    pub weight: f64,
    /// Sum of squared influences (weight × normalised residual).
    pub influence2: f64,
    /// Sum of the influences' derivatives.
    pub response: f64,
}

/// Normal equations and robust cost of `window` at `state`; plain least squares without a noise model.
///
/// With `known_normal` the normal matrix is copied instead of computed, which saves nine tenths of the products.
pub fn accumulate(
    window: &Window,
    state: &CornerState,
    noise: Option<&NoiseModel>,
    known_normal: Option<&[[f64; N]; N]>,
) -> Sums {
    let mut partial =
        Partial { normal: [[0.0; LANES]; PAIRS], gradient: [[0.0; LANES]; N], scalars: [[0.0; LANES]; 4] };
    add_window(window, &Constants::new(window, state, noise), known_normal.is_none(), &mut partial);
    let mut pair = partial.normal.iter();
    let mut normal = [[0.0; N]; N];
    for i in 0..N {
        for j in i..N {
            normal[i][j] = pair.next().map_or(0.0, total);
            normal[j][i] = normal[i][j];
        }
    }
    let [cost, weight, influence2, response] = [0, 1, 2, 3].map(|k| total(&partial.scalars[k]));
    let normal = known_normal.copied().unwrap_or(normal);
    Sums { normal, gradient: partial.gradient.map(|g| total(&g)), cost, weight, influence2, response }
}

/// Normal matrix and right side of the grey levels alone, for the geometry of `state`.
pub fn accumulate_levels(window: &Window, state: &CornerState) -> ([[f64; LEVELS]; LEVELS], [f64; LEVELS]) {
    let mut partial = [[[0.0; LANES]; LEVELS + 1]; LEVELS];
    add_levels(window, &Constants::new(window, state, None), &mut partial);
    let normal = std::array::from_fn(|i| std::array::from_fn(|j| total(&partial[i.min(j)][i.max(j)])));
    (normal, std::array::from_fn(|i| total(&partial[i][LEVELS])))
}

/// Grey level predicted by `state` at each pixel of the window.
pub fn expected_levels(window: &Window, state: &CornerState) -> Vec<f32> {
    let mut expected = vec![0.0; window.n_pixels().next_multiple_of(BLOCK)];
    write_expected(window, &Constants::new(window, state, None), &mut expected);
    expected.truncate(window.n_pixels());
    expected
}

/// Everything that does not depend on the pixel.
struct Constants {
    position: [f32; 2],
    normal: [[f32; 2]; 2],
    curvature: [f32; 2],
    inverse_blur: f32,
    correlation: f32,
    inverse_residual: f32,
    /// The pixel box's terms for each edge, from [`box_terms`].
    box_terms: [[f32; 2]; 2],
    per_half_side: f32,
    levels: [f32; LEVELS],
    robust: bool,
    variance: [f32; 2],
    variance_floor: f32,
}

impl Constants {
    fn new(window: &Window, state: &CornerState, noise: Option<&NoiseModel>) -> Self {
        let normal = state.shape.normal_rad.map(|angle| [angle.cos(), angle.sin()]);
        let correlation = normal[0][0] * normal[1][0] + normal[0][1] * normal[1][1];
        let plain = NoiseModel { offset: 1.0, per_level: 0.0, floor: 1.0 };
        let model = noise.unwrap_or(&plain);
        Self {
            position: state.position.map(|p| p as f32),
            normal: normal.map(|n| n.map(|x| x as f32)),
            curvature: state.shape.curvature_per_px.map(|c| c as f32),
            inverse_blur: (1.0 / state.shape.blur_px) as f32,
            correlation: correlation as f32,
            inverse_residual: (1.0 / (1.0 - correlation * correlation).max(1e-3).sqrt()) as f32,
            box_terms: normal.map(|n| box_terms(n, state.shape.blur_px).map(|term| term as f32)),
            per_half_side: (1.0 / window.half_side_px) as f32,
            levels: state.levels.map(|l| l as f32),
            robust: noise.is_some(),
            variance: [model.offset as f32, model.per_level as f32],
            variance_floor: model.floor as f32,
        }
    }
}

/// Effect of the pixel's box, beyond its variance, on an edge with this normal and total blur `blur_px`: the factors of
/// the third and fifth Hermite polynomials in its Edgeworth series, from the box's fourth and sixth cumulants −1/120
/// and 1/252.
pub fn box_terms(normal: [f64; 2], blur_px: f64) -> [f64; 2] {
    let power = |n: i32| normal[0].powi(n) + normal[1].powi(n);
    let root = (2.0 * std::f64::consts::PI).sqrt();
    [power(4) / (12.0 * 120.0 * root * blur_px.powi(4)), power(6) / (360.0 * 252.0 * root * blur_px.powi(6))]
}

struct Partial {
    normal: [Lanes; PAIRS],
    gradient: [Lanes; N],
    /// Cost, weight, influence², response.
    scalars: [Lanes; 4],
}

/// The pixels of a block.
struct Block<'a> {
    x: &'a Pixels,
    y: &'a Pixels,
    level: &'a Pixels,
    /// 1 where there is a pixel, 0 in the padding.
    present: &'a Pixels,
}

/// The blocks of a padded window.
#[inline(always)]
fn blocks(window: &Window) -> impl Iterator<Item = Block<'_>> {
    let [x, y, level, present] =
        [&window.x, &window.y, &window.level, &window.present].map(|all| all.as_chunks::<BLOCK>().0);
    let whole = x.iter().zip(y).zip(level.iter().zip(present));
    whole.map(|((x, y), (level, present))| Block { x, y, level, present })
}

#[multiversion(targets("x86_64+avx2"))]
fn add_window(window: &Window, c: &Constants, with_normal: bool, sums: &mut Partial) {
    let mut rows = [[0.0; BLOCK]; N];
    let (mut residual, mut scale, mut weighted) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
    let mut scalars = [[0.0; BLOCK]; 4];
    for block in blocks(window) {
        for k in 0..BLOCK {
            let at = c.cross(block.x[k], block.y[k]);
            let s = at.value;
            let (x, y) = (block.x[k] * c.per_half_side, block.y[k] * c.per_half_side);
            let contrast = c.levels[3] + c.levels[4] * x + c.levels[5] * y;
            let expected = c.levels[0] + c.levels[1] * x + c.levels[2] * y + contrast * s;
            let r = block.level[k] - expected;
            for i in 0..5 {
                rows[i][k] = contrast * at.slopes[i];
            }
            rows[5][k] = 1.0;
            rows[6][k] = x;
            rows[7][k] = y;
            rows[8][k] = s;
            rows[9][k] = x * s;
            rows[10][k] = y * s;
            let robust = c.robust(r, expected);
            residual[k] = r;
            scale[k] = block.present[k] * robust.weight * robust.inverse_variance;
            scalars[0][k] = block.present[k] * robust.loss;
            scalars[1][k] = block.present[k] * robust.weight;
            scalars[2][k] = scale[k] * robust.weight * r * r;
            scalars[3][k] = block.present[k] * robust.response;
        }
        for k in 0..BLOCK {
            residual[k] *= scale[k];
        }
        for i in 0..N {
            add_products(&mut sums.gradient[i], &rows[i], &residual);
        }
        if with_normal {
            let mut pair = 0;
            for i in 0..N {
                for k in 0..BLOCK {
                    weighted[k] = scale[k] * rows[i][k];
                }
                for j in i..N {
                    add_products(&mut sums.normal[pair], &weighted, &rows[j]);
                    pair += 1;
                }
            }
        }
        for (sum, values) in sums.scalars.iter_mut().zip(&scalars) {
            for chunk in values.chunks_exact(LANES) {
                for lane in 0..LANES {
                    sum[lane] += chunk[lane];
                }
            }
        }
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn add_levels(window: &Window, c: &Constants, sums: &mut [[Lanes; LEVELS + 1]; LEVELS]) {
    let mut rows = [[0.0; BLOCK]; LEVELS + 1];
    for block in blocks(window) {
        for k in 0..BLOCK {
            let s = block.present[k] * c.value(block.x[k], block.y[k]);
            let (x, y) = (block.x[k] * c.per_half_side, block.y[k] * c.per_half_side);
            rows[0][k] = block.present[k];
            rows[1][k] = x;
            rows[2][k] = y;
            rows[3][k] = s;
            rows[4][k] = x * s;
            rows[5][k] = y * s;
            rows[LEVELS][k] = block.level[k];
        }
        for i in 0..LEVELS {
            for j in i..=LEVELS {
                add_products(&mut sums[i][j], &rows[i], &rows[j]);
            }
        }
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn write_expected(window: &Window, c: &Constants, target: &mut [f32]) {
    for (block, target) in blocks(window).zip(target.chunks_exact_mut(BLOCK)) {
        for k in 0..BLOCK {
            let (x, y) = (block.x[k] * c.per_half_side, block.y[k] * c.per_half_side);
            let contrast = c.levels[3] + c.levels[4] * x + c.levels[5] * y;
            target[k] =
                c.levels[0] + c.levels[1] * x + c.levels[2] * y + contrast * c.value(block.x[k], block.y[k]);
        }
    }
}

#[inline(always)]
fn add_products(sum: &mut Lanes, a: &Pixels, b: &Pixels) {
    let mut lanes = *sum;
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    *sum = lanes;
}

fn total(lanes: &Lanes) -> f64 {
    lanes.iter().map(|&lane| f64::from(lane)).sum()
}

/// The blurred crossing at one pixel: value, and slopes by u, v, both normals and blur.
struct CrossAt {
    value: f32,
    slopes: [f32; 5],
}

/// Contribution of one residual.
struct Robust {
    inverse_variance: f32,
    weight: f32,
    loss: f32,
    /// Derivative of the influence weight × residual.
    response: f32,
}

impl Constants {
    /// Distance to edge `k` and position along it (px).
    #[inline(always)]
    fn edge(&self, k: usize, q: [f32; 2]) -> (f32, f32) {
        let n = self.normal[k];
        let along = n[0] * q[1] - n[1] * q[0];
        (n[0] * q[0] + n[1] * q[1] - 0.5 * self.curvature[k] * along * along, along)
    }

    #[inline(always)]
    fn value(&self, x_px: f32, y_px: f32) -> f32 {
        let q = [x_px - self.position[0], y_px - self.position[1]];
        let (x, y) = (self.edge(0, q).0 * self.inverse_blur, self.edge(1, q).0 * self.inverse_blur);
        let ((e1, gauss1), (e2, gauss2)) = (self.edge_profile(0, x), self.edge_profile(1, y));
        e1 * e2 + 2.0 / PI * gauss1 * gauss2 * self.series(x, y)
    }

    /// Profile of edge `k` at `x` blurs from it, −1 … 1, including the pixel's box, and exp(−x²/2).
    #[inline(always)]
    fn edge_profile(&self, k: usize, x: f32) -> (f32, f32) {
        let (e, gauss) = erf_and_gauss(x);
        let [fourth, sixth] = self.box_terms[k];
        let square = x * x;
        let odd = fourth * (square - 3.0) - sixth * (square * (square - 10.0) + 15.0);
        (e + x * gauss * odd, gauss)
    }

    #[inline(always)]
    fn series(&self, x: f32, y: f32) -> f32 {
        let rho = self.correlation;
        rho + 0.5 * rho * rho * x * y + rho * rho * rho * (1.0 / 6.0) * (x * x - 1.0) * (y * y - 1.0)
    }

    #[inline(always)]
    fn cross(&self, x_px: f32, y_px: f32) -> CrossAt {
        let q = [x_px - self.position[0], y_px - self.position[1]];
        let ((d1, along1), (d2, along2)) = (self.edge(0, q), self.edge(1, q));
        let (x, y) = (d1 * self.inverse_blur, d2 * self.inverse_blur);
        let ((e1, gauss1), (e2, gauss2)) = (self.edge_profile(0, x), self.edge_profile(1, y));
        let value = e1 * e2 + 2.0 / PI * gauss1 * gauss2 * self.series(x, y);
        let slope = FRAC_2_SQRT_PI * FRAC_1_SQRT_2 * self.inverse_blur;
        let rho = self.correlation;
        let by_d1 = slope * gauss1 * erf_and_gauss((y - rho * x) * self.inverse_residual).0;
        let by_d2 = slope * gauss2 * erf_and_gauss((x - rho * y) * self.inverse_residual).0;
        let [n1, n2] = self.normal;
        let (bend1, bend2) = (self.curvature[0] * along1, self.curvature[1] * along2);
        CrossAt {
            value,
            slopes: [
                -by_d1 * (n1[0] + bend1 * n1[1]) - by_d2 * (n2[0] + bend2 * n2[1]),
                -by_d1 * (n1[1] - bend1 * n1[0]) - by_d2 * (n2[1] - bend2 * n2[0]),
                by_d1 * along1,
                by_d2 * along2,
                -(by_d1 * d1 + by_d2 * d2) * self.inverse_blur,
            ],
        }
    }

    /// Tukey's bisquare; plain least squares without a noise model.
    #[inline(always)]
    fn robust(&self, residual: f32, expected: f32) -> Robust {
        const LIMIT: f32 = (TUKEY_SIGMAS * TUKEY_SIGMAS) as f32;
        let inverse_variance = 1.0 / larger(self.variance[0] + self.variance[1] * expected, self.variance_floor);
        let square = residual * residual * inverse_variance;
        let t = square * (1.0 / LIMIT);
        let keep = larger(1.0 - t, 0.0);
        if self.robust {
            Robust {
                inverse_variance,
                weight: keep * keep,
                loss: LIMIT / 3.0 * (1.0 - keep * keep * keep),
                response: keep * (1.0 - 5.0 * t),
            }
        } else {
            Robust { inverse_variance, weight: 1.0, loss: square, response: 1.0 }
        }
    }
}

/// The larger of two numbers; a single instruction, unlike `f32::max`.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// erf(x/√2) and exp(−x²/2). Abramowitz & Stegun 7.1.26, absolute error below 3·10⁻⁷.
#[inline(always)]
fn erf_and_gauss(x: f32) -> (f32, f32) {
    let gauss = exp_of_negative(-0.5 * x * x);
    let t = 1.0 / (1.0 + 0.327_591_1 * FRAC_1_SQRT_2 * x.abs());
    let poly = t * (0.254_829_6 + t * (-0.284_496_72 + t * (1.421_413_8 + t * (-1.453_152_1 + t * 1.061_405_4))));
    ((1.0 - poly * gauss).copysign(x), gauss)
}

/// exp(z) for z ≤ 0, relative error below 2·10⁻⁷; 10⁻³⁵ for all z below −80.
#[inline(always)]
fn exp_of_negative(z: f32) -> f32 {
    /// 1.5 · 2²³: adding it leaves the nearest integer in the lowest bits.
    const ROUNDER: f32 = 12_582_912.0;
    let power = larger(z, -80.0) * LOG2_E;
    let rounded = power + ROUNDER;
    let f = power - (rounded - ROUNDER);
    // Taylor series of 2^f for |f| ≤ 1/2.
    let two_to_f = 1.0
        + f * (LN_2
            + f * (0.240_226_5
                + f * (0.055_504_11 + f * (0.009_618_129 + f * (0.001_333_355_8 + f * 0.000_154_035_3)))));
    f32::from_bits(two_to_f.to_bits().wrapping_add(rounded.to_bits() << 23))
}
