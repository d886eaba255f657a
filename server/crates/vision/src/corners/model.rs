//! What a blurred chessboard corner looks like.
//!
//! Two edges cross; the signed distances to them are d₁ and d₂. An isotropic Gaussian blur of
//! sign(d₁)·sign(d₂) is, with x = d₁/σ, y = d₂/σ and ρ the cosine between the edge normals,
//!
//! S(x, y; ρ) = 4 Φ₂(x, y; ρ) − 2 Φ(x) − 2 Φ(y) + 1 = erf(x/√2) erf(y/√2) + 4 φ(x) φ(y) (ρ + ρ² x y / 2 + ρ³ (x²−1)(y²−1) / 6 + …)
//!
//! (tetrachoric series of the bivariate normal Φ₂). The pixel's own box adds 1/12 px² to σ².

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Local shape of the crossing: two edges with their curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CrossShape {
    /// Angles of the edge normals (rad); the first points to the next board column, the second to the next row.
    pub normal_rad: [f64; 2],
    /// Curvature of each edge, positive towards its normal (1/px).
    pub curvature_per_px: [f64; 2],
    /// Blur (Gaussian sigma, pixel box included).
    pub blur_px: f64,
}

/// Value of the blurred crossing, −1 … 1, and its derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct CrossValue {
    /// S itself.
    pub value: f64,
    /// dS/du and dS/dv of the crossing point (1/px).
    pub by_position: [f64; 2],
    /// dS/dθ of the two edge normals (1/rad).
    pub by_normal: [f64; 2],
    /// dS/dσ (1/px).
    pub by_blur: f64,
}

/// A [`CrossShape`] with everything computed that does not depend on the pixel.
pub(super) struct Cross {
    normal: [[f64; 2]; 2],
    curvature_per_px: [f64; 2],
    inverse_blur: f64,
    correlation: f64,
    inverse_residual: f64,
}

impl Cross {
    pub(super) fn new(shape: &CrossShape) -> Self {
        let normal = shape.normal_rad.map(|angle| [angle.cos(), angle.sin()]);
        let correlation = normal[0][0] * normal[1][0] + normal[0][1] * normal[1][1];
        Self {
            normal,
            curvature_per_px: shape.curvature_per_px,
            inverse_blur: 1.0 / shape.blur_px,
            correlation,
            inverse_residual: 1.0 / (1.0 - correlation * correlation).max(1e-3).sqrt(),
        }
    }

    /// Distances to the two edges and positions along them (px), `q` relative to the crossing.
    pub(super) fn edge_coordinates(&self, q: [f64; 2]) -> [(f64, f64); 2] {
        [0, 1].map(|k| {
            let n = self.normal[k];
            let along = -n[1] * q[0] + n[0] * q[1];
            (n[0] * q[0] + n[1] * q[1] - 0.5 * self.curvature_per_px[k] * along * along, along)
        })
    }

    /// The blurred crossing at `q`, pixels relative to the crossing point.
    pub(super) fn at(&self, q: [f64; 2]) -> CrossValue {
        let [(d1, along1), (d2, along2)] = self.edge_coordinates(q);
        let (x, y) = (d1 * self.inverse_blur, d2 * self.inverse_blur);
        let (e1, gauss1) = erf_and_gauss(x);
        let (e2, gauss2) = erf_and_gauss(y);
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

/// erf(x/√2) and exp(−x²/2). Abramowitz & Stegun 7.1.26, absolute error below 1.5·10⁻⁷; beyond six sigmas 1 and 0.
fn erf_and_gauss(x: f64) -> (f64, f64) {
    if x.abs() > 6.0 {
        return (1f64.copysign(x), 0.0);
    }
    let gauss = (-0.5 * x * x).exp();
    let t = 1.0 / (1.0 + 0.327_591_1 * FRAC_1_SQRT_2 * x.abs());
    let poly = t
        * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    ((1.0 - poly * gauss).copysign(x), gauss)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: CrossShape = CrossShape { normal_rad: [0.3, 1.6], curvature_per_px: [1e-3, -2e-3], blur_px: 1.1 };

    /// Brute-force blur of the sharp crossing on a fine raster.
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
        // A corner that moves by t sees the pixel at q − t. 1 % of the largest: the series stops after ρ³.
        let tolerance = 0.01;
        let by_u = numeric(&|t| (SHAPE, [q[0] - t, q[1]]));
        let by_v = numeric(&|t| (SHAPE, [q[0], q[1] - t]));
        let by_blur = numeric(&|t| (CrossShape { blur_px: SHAPE.blur_px + t, ..SHAPE }, q));
        assert!((by_u - value.by_position[0]).abs() < tolerance);
        assert!((by_v - value.by_position[1]).abs() < tolerance);
        assert!((by_blur - value.by_blur).abs() < tolerance);
    }
}
