//! Specification limits, and the expected fraction of parts outside them.

use crate::distributions::normal_cdf;
use crate::params::PPM;

/// Specification limits, absolute, in the unit of the values; one may be absent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecificationLimits {
    /// Lower limit L.
    pub lower: Option<f64>,
    /// Upper limit H.
    pub upper: Option<f64>,
}

/// Expected nonconforming parts per million if values are normal, eq. (27).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nonconforming {
    /// Below the lower limit; `None` without one.
    pub below_ppm: Option<f64>,
    /// Above the upper limit; `None` without one.
    pub above_ppm: Option<f64>,
    /// Both together.
    pub total_ppm: f64,
}

/// Expectation for normal values with `mean` and `sigma` > 0.
pub(super) fn expected_nonconforming(mean: f64, sigma: f64, limits: SpecificationLimits) -> Nonconforming {
    let below_ppm = limits.lower.map(|lower| PPM * normal_cdf((lower - mean) / sigma));
    let above_ppm = limits.upper.map(|upper| PPM * normal_cdf((mean - upper) / sigma));
    Nonconforming { below_ppm, above_ppm, total_ppm: below_ppm.unwrap_or(0.0) + above_ppm.unwrap_or(0.0) }
}
