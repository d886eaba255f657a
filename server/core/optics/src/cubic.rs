//! Cubic polynomials of two variables over the square −1…1: least-squares fit and vectorised evaluation.

use nalgebra::{DMatrix, DVector};

/// Coefficients of a cubic: 1, s, s², s³, t, ts, ts², t², t²s, t³.
pub const TERMS: usize = 10;

/// Samples along each side; a cubic needs four, the fifth makes it a least-squares fit.
const SIDE: usize = 5;

/// A cubic in s and t, both within −1…1.
pub type Cubic = [f64; TERMS];

/// Fits cubics to samples at [`CubicFit::nodes`].
#[derive(Debug, Clone)]
pub struct CubicFit {
    inverse: DMatrix<f64>,
}

impl CubicFit {
    /// Prepares the fit for samples at [`CubicFit::nodes`].
    pub fn new() -> Self {
        let nodes: Vec<(f64, f64)> = Self::nodes().collect();
        let design = DMatrix::from_fn(nodes.len(), TERMS, |row, term| terms(nodes[row].0, nodes[row].1)[term]);
        let inverse =
            design.pseudo_inverse(f64::EPSILON).expect("the tolerance, its only possible error, is not negative");
        Self { inverse }
    }

    /// Sample positions: Chebyshev nodes, which keep the largest error small.
    pub fn nodes() -> impl Iterator<Item = (f64, f64)> {
        let place = |idx: usize| ((2 * idx + 1) as f64 * std::f64::consts::PI / (2 * SIDE) as f64).cos();
        (0..SIDE * SIDE).map(move |idx| (place(idx % SIDE), place(idx / SIDE)))
    }

    /// The least-squares cubic for one value per position.
    pub fn fit(&self, values: &DVector<f64>) -> Cubic {
        let coefficients = &self.inverse * values;
        std::array::from_fn(|term| coefficients[term])
    }
}

fn terms(s: f64, t: f64) -> Cubic {
    [1.0, s, s * s, s * s * s, t, t * s, t * s * s, t * t, t * t * s, t * t * t]
}

/// Value at (s, t).
#[inline(always)]
pub fn value(c: &Cubic, s: f64, t: f64) -> f64 {
    c[0] + s * (c[1] + s * (c[2] + s * c[3]))
        + t * (c[4] + s * (c[5] + s * c[6]) + t * (c[7] + s * c[8] + t * c[9]))
}

/// Derivatives with respect to s and t.
#[inline(always)]
pub fn gradient(c: &Cubic, s: f64, t: f64) -> (f64, f64) {
    let by_s = c[1] + s * (2.0 * c[2] + s * (3.0 * c[3])) + t * (c[5] + s * (2.0 * c[6]) + t * c[8]);
    let by_t = c[4] + s * (c[5] + s * c[6]) + t * (2.0 * (c[7] + s * c[8]) + t * (3.0 * c[9]));
    (by_s, by_t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_and_its_gradient_are_recovered() {
        let sought: Cubic = [0.3, -1.2, 0.7, 0.11, 2.0, -0.4, 0.05, 0.9, -0.33, 0.21];
        let values = CubicFit::nodes().map(|(s, t)| value(&sought, s, t)).collect::<Vec<_>>();
        let found = CubicFit::new().fit(&DVector::from_vec(values));
        for (found, sought) in found.iter().zip(sought) {
            assert!((found - sought).abs() < 1e-13, "{found} {sought}");
        }
        let (s, t, step) = (0.37, -0.81, 1e-6);
        let (by_s, by_t) = gradient(&sought, s, t);
        let across = |s: f64, t: f64| value(&sought, s, t);
        assert!((by_s - (across(s + step, t) - across(s - step, t)) / (2.0 * step)).abs() < 1e-8);
        assert!((by_t - (across(s, t + step) - across(s, t - step)) / (2.0 * step)).abs() < 1e-8);
    }
}
