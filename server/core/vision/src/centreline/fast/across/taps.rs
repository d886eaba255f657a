//! Derivatives of a Gaussian across the line, up to the second.

use std::sync::LazyLock;

use crate::centreline::lines::taps::{Taps as TwoTaps, WIDTH_PER_SIGMA};
use crate::params::{STEGER_SCALE_STEP, STEGER_SIGMA_MAX_PX, STEGER_SIGMA_MIN_PX, STEGER_SIGMA_PER_LINE_SIGMA};

/// Every scale, the smallest first.
static SCALES: LazyLock<Vec<Taps>> = LazyLock::new(|| {
    let sigmas = std::iter::successors(Some(STEGER_SIGMA_MIN_PX), |sigma| Some(sigma * STEGER_SCALE_STEP));
    sigmas.take_while(|&sigma| sigma <= STEGER_SIGMA_MAX_PX).map(Taps::new).collect()
});

/// Sampled derivatives as weights of the pixels at −reach … reach.
#[derive(Debug)]
pub struct Taps {
    /// Standard deviation in pixels.
    pub sigma_px: f32,
    /// Pixels on either side of the middle.
    pub reach: usize,
    /// First and second derivative, pixel by pixel: 1 for x and x²/2.
    pub weights: Vec<[f32; 2]>,
    /// Σ of the squared weights of the first derivative.
    pub first_squared: f32,
}

impl Taps {
    fn new(sigma_px: f32) -> Self {
        let two = TwoTaps::new(sigma_px);
        let reach = two.reach();
        let weights = two.first.iter().zip(&two.second).map(|(&a, &b)| [a, b]).collect();
        let first_squared = two.first.iter().map(|g| g * g).sum();
        Self { sigma_px, reach, weights, first_squared }
    }

    /// Σ of the squared weights of the first derivative times the squared light of a Gaussian line of this width and of
    /// height one: the factor with which speckle enters its slope. Sums are approximated by integrals.
    #[inline(always)]
    pub fn speckle(&self, width_px: f32) -> f32 {
        let (kernel, line) = (1.0 / self.sigma_px, WIDTH_PER_SIGMA / width_px);
        let q = kernel * kernel + line * line;
        let sixth = kernel * kernel * kernel * kernel * kernel * kernel;
        sixth / (4.0 * std::f32::consts::PI.sqrt() * q * q.sqrt())
    }

    /// The scales that fit within `reach`, the smallest first; the smallest is always included.
    pub fn scales(reach: usize) -> &'static [Self] {
        let n_allowed = SCALES.partition_point(|taps| taps.reach <= reach).max(1);
        &SCALES[..n_allowed]
    }

    /// The scale for lines of this full width at half height along the column, the nearest by ratio.
    #[inline(always)]
    pub fn for_width(width_px: f32, scales: &'static [Self]) -> &'static Self {
        let wanted = STEGER_SIGMA_PER_LINE_SIGMA * width_px / WIDTH_PER_SIGMA;
        let mut idx = 0;
        for pair in scales.windows(2) {
            idx += usize::from(wanted * wanted >= pair[0].sigma_px * pair[1].sigma_px);
        }
        &scales[idx]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speckle_integral_matches_the_sum_over_pixels() {
        for taps in SCALES.iter() {
            for width_px in [1.5 * taps.sigma_px, 2.5 * taps.sigma_px] {
                let light = |x: f32| (-0.5 * (x * WIDTH_PER_SIGMA / width_px).powi(2)).exp();
                let about = |centre: f32| -> f32 {
                    let xs = -(taps.reach as i32)..=taps.reach as i32;
                    xs.zip(&taps.weights).map(|(x, w)| (w[0] * light(x as f32 - centre)).powi(2)).sum()
                };
                // The line lies anywhere in the middle pixel.
                let sum = [-0.4, -0.2, 0.0, 0.2, 0.4].map(about).iter().sum::<f32>() / 5.0;
                let integral = taps.speckle(width_px);
                // Kernels are sampled and truncated at three standard deviations.
                assert!((integral / sum - 1.0).abs() < 0.1, "{} {width_px}: {integral} {sum}", taps.sigma_px);
            }
        }
    }

    #[test]
    fn each_derivative_is_exact_on_its_monomial_and_zero_on_lower_ones() {
        for taps in SCALES.iter() {
            let reach = taps.reach as i32;
            let apply = |k: usize, power: i32| -> f64 {
                let terms = (-reach..=reach).zip(&taps.weights);
                terms.map(|(x, w)| f64::from(w[k]) * f64::from(x).powi(power)).sum()
            };
            // Taps are single precision; the powers grow with the reach.
            let tolerance = 1e-6 * f64::from(reach).powi(3);
            for (k, factorial) in [(0, 1.0), (1, 2.0)] {
                assert!((apply(k, k as i32 + 1) - factorial).abs() < tolerance, "{} {k}", taps.sigma_px);
                (0..=k).for_each(|power| assert!(apply(k, power as i32).abs() < tolerance));
            }
        }
    }
}
