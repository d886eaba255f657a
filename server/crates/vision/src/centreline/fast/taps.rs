//! Derivatives of a Gaussian across the line, up to the third.

use std::sync::LazyLock;

use crate::centreline::reference::steger::{Taps as TwoTaps, WIDTH_PER_SIGMA};
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
    /// First, second and third derivative, pixel by pixel: 1 for x, x²/2 and x³/6.
    pub weights: Vec<[f32; 3]>,
    /// Σ of the squared weights of the first derivative.
    pub first_squared: f32,
}

impl Taps {
    fn new(sigma_px: f32) -> Self {
        let two = TwoTaps::new(sigma_px);
        let reach = two.reach();
        let xs = || (-(reach as i32)..=reach as i32).map(f64::from);
        let gauss: Vec<f64> = two.smooth.iter().map(|&g| f64::from(g)).collect();
        let moment = |power: i32| xs().zip(&gauss).map(|(x, g)| x.powi(power) * g).sum::<f64>();
        // (x³ − a x) g is blind to a ramp for a = ⟨x⁴⟩ / ⟨x²⟩.
        let ramp = moment(4) / moment(2);
        let unit = (moment(6) - ramp * moment(4)) / 6.0;
        let third = xs().zip(&gauss).map(|(x, g)| ((x * x * x - ramp * x) * g / unit) as f32);
        let weights = two.first.iter().zip(&two.second).zip(third).map(|((&a, &b), c)| [a, b, c]).collect();
        let first_squared = two.first.iter().map(|g| g * g).sum();
        Self { sigma_px, reach, weights, first_squared }
    }

    /// The scale for lines of this full width at half height along the column, the nearest that reaches no further
    /// than `reach`.
    pub fn for_width(width_px: f32, reach: usize) -> &'static Self {
        let wanted = STEGER_SIGMA_PER_LINE_SIGMA * width_px / WIDTH_PER_SIGMA;
        let n_allowed = SCALES.partition_point(|taps| taps.reach <= reach).max(1);
        let allowed = &SCALES[..n_allowed];
        let idx = allowed.partition_point(|taps| taps.sigma_px < wanted).min(n_allowed - 1);
        let lower = idx.saturating_sub(1);
        let nearer_lower = wanted * wanted < allowed[lower].sigma_px * allowed[idx].sigma_px;
        &allowed[if nearer_lower { lower } else { idx }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_derivative_is_exact_on_its_power_and_blind_to_the_lower_ones() {
        for taps in SCALES.iter() {
            let reach = taps.reach as i32;
            let apply = |k: usize, power: i32| -> f64 {
                let terms = (-reach..=reach).zip(&taps.weights);
                terms.map(|(x, w)| f64::from(w[k]) * f64::from(x).powi(power)).sum()
            };
            // Taps are single precision; the powers grow with the reach.
            let tolerance = 1e-6 * f64::from(reach).powi(3);
            for (k, factorial) in [(0, 1.0), (1, 2.0), (2, 6.0)] {
                assert!((apply(k, k as i32 + 1) - factorial).abs() < tolerance, "{} {k}", taps.sigma_px);
                (0..=k).for_each(|power| assert!(apply(k, power as i32).abs() < tolerance));
            }
        }
    }
}
