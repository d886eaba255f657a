//! Gaussian derivatives (Steger 1998, TPAMI 20(2), section 3), sampled.

use crate::params::STEGER_CUT_SIGMAS;

/// Full width at half height of a Gaussian over its standard deviation: 2 √(2 ln 2).
pub const WIDTH_PER_SIGMA: f32 = 2.354_82;

/// Sampled Gaussian and its first two derivatives, as weights of pixels at −r … r.
///
/// Normalised on the samples: `smooth` sums to one, `first` gives 1 for a unit ramp and `second` gives 1 for
/// x²/2 and 0 for a constant.
pub struct Taps {
    /// Gaussian.
    pub smooth: Vec<f32>,
    /// First derivative.
    pub first: Vec<f32>,
    /// Second derivative.
    pub second: Vec<f32>,
}

impl Taps {
    /// Taps for one scale.
    pub fn new(sigma_px: f32) -> Self {
        let reach = (STEGER_CUT_SIGMAS * sigma_px).ceil() as i32;
        let xs: Vec<f64> = (-reach..=reach).map(f64::from).collect();
        let var = f64::from(sigma_px) * f64::from(sigma_px);
        let mut smooth: Vec<f64> = xs.iter().map(|x| (-0.5 * x * x / var).exp()).collect();
        let sum: f64 = smooth.iter().sum();
        smooth.iter_mut().for_each(|g| *g /= sum);
        let ramp: f64 = xs.iter().zip(&smooth).map(|(x, g)| x * x * g).sum();
        let first = xs.iter().zip(&smooth).map(|(x, g)| (x * g / ramp) as f32).collect();
        let curved: Vec<f64> = xs.iter().zip(&smooth).map(|(x, g)| (x * x - ramp) * g).collect();
        let unit: f64 = xs.iter().zip(&curved).map(|(x, c)| 0.5 * x * x * c).sum();
        let second = curved.iter().map(|c| (c / unit) as f32).collect();
        Self { smooth: smooth.iter().map(|&g| g as f32).collect(), first, second }
    }

    /// Pixels on either side of the middle.
    pub fn reach(&self) -> usize {
        self.smooth.len() / 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampled_derivatives_are_exact_on_parabolas() {
        for sigma in [1.0, 2.3, 6.0] {
            let taps = Taps::new(sigma);
            let parabola = |x: f64| 3.0 + 0.7 * x + 0.2 * x * x;
            let reach = taps.reach() as i32;
            let apply = |weights: &[f32]| -> f64 {
                (-reach..=reach).zip(weights).map(|(x, &w)| f64::from(w) * parabola(f64::from(x))).sum()
            };
            // Taps are single precision.
            assert!((apply(&taps.first) - 0.7).abs() < 1e-5);
            assert!((apply(&taps.second) - 0.4).abs() < 1e-5);
        }
    }
}
