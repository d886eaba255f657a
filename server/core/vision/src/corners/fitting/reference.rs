//! Reference implementation of the corner model and its sums in double precision, against which the fast sums are
//! tested.

// Matrix loops in mathematical notation.
#![allow(clippy::needless_range_loop)]

use std::f64::consts::PI;

use super::fit::{N, NoiseModel, Window};
use super::model::CrossShape;
use super::sums::{CornerState, Sums, accumulate, accumulate_levels, box_terms, expected_levels};
use crate::corners::erf_and_gauss;
use crate::corners::params::TUKEY_SIGMAS;

/// Value of the blurred crossing, −1 … 1, and its derivatives.
#[derive(Debug, Clone, Copy)]
struct CrossValue {
    /// S itself.
    pub value: f64,
    /// dS/du and dS/dv of the crossing point (1/px).
    pub by_position: [f64; 2],
    /// dS/dθ of the two edge normals (1/rad).
    pub by_normal: [f64; 2],
    /// dS/dσ (1/px).
    pub by_blur: f64,
}

/// A [`CrossShape`] with everything precomputed that does not depend on the pixel.
struct Cross {
    normal: [[f64; 2]; 2],
    curvature_per_px: [f64; 2],
    inverse_blur: f64,
    correlation: f64,
    inverse_residual: f64,
    box_terms: [[f64; 2]; 2],
}

impl Cross {
    fn new(shape: &CrossShape) -> Self {
        let normal = shape.normal_rad.map(|angle| [angle.cos(), angle.sin()]);
        let correlation = normal[0][0] * normal[1][0] + normal[0][1] * normal[1][1];
        Self {
            normal,
            curvature_per_px: shape.curvature_per_px,
            inverse_blur: 1.0 / shape.blur_px,
            correlation,
            inverse_residual: 1.0 / (1.0 - correlation * correlation).max(1e-3).sqrt(),
            box_terms: normal.map(|n| box_terms(n, shape.blur_px)),
        }
    }

    /// Distances to the two edges and positions along them (px), `q` relative to the crossing.
    fn edge_coordinates(&self, q: [f64; 2]) -> [(f64, f64); 2] {
        [0, 1].map(|k| {
            let n = self.normal[k];
            let along = -n[1] * q[0] + n[0] * q[1];
            (n[0] * q[0] + n[1] * q[1] - 0.5 * self.curvature_per_px[k] * along * along, along)
        })
    }

    /// The blurred crossing at `q`, pixels relative to the crossing point.
    fn at(&self, q: [f64; 2]) -> CrossValue {
        let [(d1, along1), (d2, along2)] = self.edge_coordinates(q);
        let (x, y) = (d1 * self.inverse_blur, d2 * self.inverse_blur);
        let (e1, gauss1) = erf_and_gauss(x);
        let (e2, gauss2) = erf_and_gauss(y);
        // Hermite polynomials He3 and He5.
        let boxed = |k: usize, x: f64| {
            let [fourth, sixth] = self.box_terms[k];
            fourth * (x.powi(3) - 3.0 * x) - sixth * (x.powi(5) - 10.0 * x.powi(3) + 15.0 * x)
        };
        let (e1, e2) = (e1 + boxed(0, x) * gauss1, e2 + boxed(1, y) * gauss2);
        let rho = self.correlation;
        let series = rho + 0.5 * rho * rho * x * y + rho * rho * rho / 6.0 * (x * x - 1.0) * (y * y - 1.0);
        let value = e1 * e2 + 2.0 / PI * gauss1 * gauss2 * series;
        let slope = 2.0 * self.inverse_blur / (2.0 * PI).sqrt();
        let by_distance = |gauss: f64, other: f64| {
            if gauss > 0.0 { slope * gauss * erf_and_gauss(other * self.inverse_residual).0 } else { 0.0 }
        };
        let (by_d1, by_d2) = (by_distance(gauss1, y - rho * x), by_distance(gauss2, x - rho * y));
        let [g1, g2] = [self.gradient(0, along1), self.gradient(1, along2)];
        CrossValue {
            value,
            by_position: [-by_d1 * g1[0] - by_d2 * g2[0], -by_d1 * g1[1] - by_d2 * g2[1]],
            by_normal: [by_d1 * along1, by_d2 * along2],
            by_blur: -(by_d1 * d1 + by_d2 * d2) * self.inverse_blur,
        }
    }

    /// Gradient of the distance to edge `k` with respect to the pixel.
    fn gradient(&self, k: usize, along: f64) -> [f64; 2] {
        let n = self.normal[k];
        let bend = self.curvature_per_px[k] * along;
        [n[0] + bend * n[1], n[1] - bend * n[0]]
    }
}

fn level_basis(x: f64, y: f64, s: f64) -> [f64; 6] {
    [1.0, x, y, s, x * s, y * s]
}

/// Normal equations and robust cost at `state`.
fn plain_sums(window: &Window, state: &CornerState, noise: Option<&NoiseModel>) -> Sums {
    let cross = Cross::new(&state.shape);
    let mut sums =
        Sums { normal: [[0.0; N]; N], gradient: [0.0; N], cost: 0.0, weight: 0.0, influence2: 0.0, response: 0.0 };
    for k in 0..window.n_pixels() {
        let [x, y, level] = [window.x[k], window.y[k], window.level[k]].map(f64::from);
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
            sums.gradient[i] += weighted * residual;
            for j in 0..N {
                sums.normal[i][j] += weighted * row[j];
            }
        }
        sums.cost += loss;
        sums.weight += weight;
        sums.influence2 += weight * weight * residual * residual / variance;
        sums.response += response;
    }
    sums
}

/// Contribution of one residual.
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
    let variance = (noise.offset + noise.per_level * expected).max(noise.floor);
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

const SHAPE: CrossShape = CrossShape { normal_rad: [0.3, 1.6], curvature_per_px: [1e-3, -2e-3], blur_px: 1.1 };

/// Blur of the sharp crossing by brute-force summation on a fine raster.
fn blurred_by_summation(shape: &CrossShape, q: [f64; 2]) -> f64 {
    let cross = Cross::new(shape);
    let (step, reach) = (0.02, 5.0 * shape.blur_px);
    let n = (reach / step) as i32;
    let (mut sum, mut weight) = (0.0, 0.0);
    for i in -n..=n {
        for j in -n..=n {
            let (x, y) = (f64::from(i) * step, f64::from(j) * step);
            let w = (-(x * x + y * y) / (2.0 * shape.blur_px * shape.blur_px)).exp();
            let [(d1, _), (d2, _)] = cross.edge_coordinates([q[0] + x, q[1] + y]);
            sum += w * d1.signum() * d2.signum();
            weight += w;
        }
    }
    sum / weight
}

#[test]
fn the_model_is_the_blurred_crossing() {
    let shape = CrossShape { curvature_per_px: [0.0; 2], ..SHAPE };
    for q in [[0.0, 0.0], [0.7, -0.4], [-1.5, 2.0], [3.0, 0.2]] {
        let error = Cross::new(&shape).at(q).value - blurred_by_summation(&shape, q);
        // The series stops after ρ³ (ρ = 0.27 here); the raster adds 10⁻³.
        assert!(error.abs() < 3e-3, "at {q:?}: {error}");
    }
}

/// An edge through the far end of the crossing, blurred by summation over a pixel's box: hardly any other blur remains.
#[test]
fn an_edge_sharper_than_a_pixel_has_the_profile_of_its_box() {
    let light_px: f64 = 0.3;
    for angle in [0.0, 0.3, std::f64::consts::FRAC_PI_4] {
        let shape = CrossShape {
            normal_rad: [angle, angle + std::f64::consts::FRAC_PI_2],
            curvature_per_px: [0.0; 2],
            blur_px: (light_px * light_px + 1.0 / 12.0).sqrt(),
        };
        let cross = Cross::new(&shape);
        for d in [0.1, 0.3, 0.5, 0.8, 1.2] {
            let [n, along] = [[angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]];
            let place = [0, 1].map(|k| d * n[k] + 30.0 * along[k]);
            let steps = (0..100).map(|k| (f64::from(k) + 0.5) / 100.0 - 0.5);
            let sum: f64 = steps
                .clone()
                .flat_map(|x| steps.clone().map(move |y| d + x * n[0] + y * n[1]))
                .map(|distance| erf_and_gauss(distance / light_px).0)
                .sum();
            let error = cross.at(place).value - sum / 1e4;
            // Without the box's cumulants the error is 0.011.
            assert!(error.abs() < 0.0025, "{angle} at {d}: {error}");
        }
    }
}

#[test]
fn the_derivatives_agree_with_central_differences() {
    let q = [0.8, -0.9];
    let value = Cross::new(&SHAPE).at(q);
    let h = 1e-3;
    let numeric = |change: &dyn Fn(f64) -> (CrossShape, [f64; 2])| {
        let s = |t| {
            let (shape, q) = change(t);
            Cross::new(&shape).at(q).value
        };
        (s(h) - s(-h)) / (2.0 * h)
    };
    // A corner that moves by t samples the pixel at q − t. 1 % of the largest value: the series stops after ρ³.
    let tolerance = 0.01;
    let by_u = numeric(&|t| (SHAPE, [q[0] - t, q[1]]));
    let by_v = numeric(&|t| (SHAPE, [q[0], q[1] - t]));
    let by_blur = numeric(&|t| (CrossShape { blur_px: SHAPE.blur_px + t, ..SHAPE }, q));
    assert!((by_u - value.by_position[0]).abs() < tolerance);
    assert!((by_v - value.by_position[1]).abs() < tolerance);
    assert!((by_blur - value.by_blur).abs() < tolerance);
}

/// A window of 21 × 17 pixels (not a whole number of blocks) with the pattern, a slope, and a ripple instead of noise.
fn window() -> (Window, CornerState) {
    let state = CornerState { position: [0.31, -0.22], shape: SHAPE, levels: [118.0, 6.0, -4.0, 71.0, 3.0, 5.0] };
    let cross = Cross::new(&SHAPE);
    let mut window = Window::new([400.0, 300.0], 9.5, 400);
    for v in -8..=8 {
        for u in -10..=10 {
            let (x, y) = (f64::from(u), f64::from(v));
            let s = cross.at([x - state.position[0], y - state.position[1]]).value;
            let basis = level_basis(x / 9.5, y / 9.5, s);
            let level: f64 = basis.iter().zip(&state.levels).map(|(b, l)| b * l).sum();
            window.push_run(u as f32, v as f32, &[(level + 2.0 * (3.1 * x + 1.7 * y).sin()) as f32]);
        }
    }
    (window.padded(), state)
}

/// Single precision over some hundred pixels, relative to the largest of a kind.
const ROUNDING: f64 = 2e-5;

#[test]
fn the_fast_sums_match_the_reference() {
    let (mut window, mut state) = window();
    // Some steps away, where the gradient is not small; one pixel is an outlier that Tukey's weight removes.
    state.position[0] += 0.1;
    window.level[40] += 90.0;
    let noise = NoiseModel { offset: 1.5, per_level: 0.02, floor: 1.0 };
    for noise in [None, Some(&noise)] {
        let (fast, plain) = (accumulate(&window, &state, noise, None), plain_sums(&window, &state, noise));
        for i in 0..N {
            for j in 0..N {
                let unit = (plain.normal[i][i] * plain.normal[j][j]).sqrt();
                let error = (fast.normal[i][j] - plain.normal[i][j]).abs();
                assert!(error < ROUNDING * unit, "normal {i},{j}: {error} of {unit}");
            }
            let unit = (plain.normal[i][i] * plain.influence2.max(1.0)).sqrt();
            assert!((fast.gradient[i] - plain.gradient[i]).abs() < ROUNDING * unit, "gradient {i}");
        }
        let scalars = |s: &Sums| [s.cost, s.weight, s.influence2, s.response];
        for (fast, plain) in scalars(&fast).into_iter().zip(scalars(&plain)) {
            assert!((fast - plain).abs() < ROUNDING * plain.abs(), "{fast} {plain}");
        }
    }
}

#[test]
fn with_a_known_normal_matrix_the_other_sums_are_unchanged() {
    let (window, state) = window();
    let noise = NoiseModel { offset: 1.5, per_level: 0.02, floor: 1.0 };
    let whole = accumulate(&window, &state, Some(&noise), None);
    let known = [[7.0; N]; N];
    let rest = accumulate(&window, &state, Some(&noise), Some(&known));
    assert_eq!(rest.normal, known);
    assert_eq!(rest.gradient, whole.gradient);
    let scalars = |s: &Sums| [s.cost, s.weight, s.influence2, s.response];
    assert_eq!(scalars(&rest), scalars(&whole));
}

#[test]
fn the_levels_and_the_predictions_match_the_reference() {
    let (window, state) = window();
    let cross = Cross::new(&state.shape);
    let mut plain = [[0.0; 7]; 6];
    let expected = expected_levels(&window, &state);
    assert_eq!(expected.len(), window.n_pixels());
    for k in 0..window.n_pixels() {
        let [x, y, level] = [window.x[k], window.y[k], window.level[k]].map(f64::from);
        let s = cross.at([x - state.position[0], y - state.position[1]]).value;
        let basis = level_basis(x / window.half_side_px, y / window.half_side_px, s);
        let value: f64 = basis.iter().zip(&state.levels).map(|(b, l)| b * l).sum();
        assert!((value - f64::from(expected[k])).abs() < 1e-3 * state.levels[3], "pixel {k}");
        for i in 0..6 {
            for j in 0..6 {
                plain[i][j] += basis[i] * basis[j];
            }
            plain[i][6] += basis[i] * level;
        }
    }
    let (normal, right) = accumulate_levels(&window, &state);
    for i in 0..6 {
        for j in 0..6 {
            let unit = (plain[i][i] * plain[j][j]).sqrt();
            assert!((normal[i][j] - plain[i][j]).abs() < ROUNDING * unit, "{i},{j}");
        }
        let unit = plain[0][6] * (plain[i][i] / plain[0][0]).sqrt();
        assert!((right[i] - plain[i][6]).abs() < ROUNDING * unit, "right {i}");
    }
}
