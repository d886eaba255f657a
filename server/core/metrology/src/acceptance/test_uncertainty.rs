//! Uncertainty of a test: what is not known of the artefact. The errors of the station are what is tested, and no part of it.

use super::plan::{SpherePairTest, SphereTest};
use crate::params::{EXPANSION_UNCERTAINTY_RELATIVE, REFERENCE_TEMPERATURE_C, THERMOMETER_UNCERTAINTY_K};

/// A calibrated length at the temperature of the test, with the expanded uncertainty (k = 2) of it, mm.
pub(crate) struct WarmLength {
    pub(crate) length_mm: f64,
    /// `None` if the temperature is unknown.
    pub(crate) uncertainty_mm: Option<f64>,
}

/// The diameter of a ball at a temperature.
pub(crate) fn diameter(test: &SphereTest, temperature_c: Option<f64>) -> WarmLength {
    warm(test.diameter_mm, test.uncertainty_mm, test.expansion_per_k, temperature_c)
}

/// The distance of two balls at a temperature.
pub(crate) fn spacing(test: &SpherePairTest, temperature_c: Option<f64>) -> WarmLength {
    warm(test.distance_mm, test.uncertainty_mm, test.expansion_per_k, temperature_c)
}

fn warm(length_mm: f64, certificate_mm: f64, expansion_per_k: f64, temperature_c: Option<f64>) -> WarmLength {
    let Some(temperature_c) = temperature_c else { return WarmLength { length_mm, uncertainty_mm: None } };
    let warmer_k = temperature_c - REFERENCE_TEMPERATURE_C;
    let of_thermometer = length_mm * expansion_per_k * THERMOMETER_UNCERTAINTY_K;
    let of_coefficient = length_mm * expansion_per_k * EXPANSION_UNCERTAINTY_RELATIVE * warmer_k;
    WarmLength {
        length_mm: length_mm * (1.0 + expansion_per_k * warmer_k),
        uncertainty_mm: Some(certificate_mm.hypot(of_thermometer).hypot(of_coefficient)),
    }
}

/// Expanded uncertainty of a form error, mm: the form of the artefact adds to what is measured, at worst fully
/// (ISO/TS 23165: standard uncertainty F/2).
pub(crate) fn of_form_mm(form_mm: f64) -> f64 {
    form_mm
}

/// Expanded uncertainty of a standard deviation from `n` normal values: 2·s/√(2(n − 1)).
pub(crate) fn of_standard_deviation(deviation: f64, n: usize) -> f64 {
    2.0 * deviation / (2.0 * (n.max(2) - 1) as f64).sqrt()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_length_grows_with_its_temperature_and_its_uncertainty_with_the_distance_from_20_degrees() {
        // 100 mm of steel at 30 °C: 11.5 µm longer; the coefficient is known to 10 %, the temperature to 0.5 K.
        let warm = warm(100.0, 0.001, 11.5e-6, Some(30.0));
        assert!((warm.length_mm - 100.0115).abs() < 1e-9);
        let expected = (0.001f64.powi(2) + 0.000_575f64.powi(2) + 0.001_15f64.powi(2)).sqrt();
        assert!((warm.uncertainty_mm.unwrap() - expected).abs() < 1e-9, "{:?}", warm.uncertainty_mm);
    }

    #[test]
    fn a_length_at_an_unknown_temperature_has_no_uncertainty() {
        let warm = warm(100.0, 0.001, 11.5e-6, None);
        assert_eq!((warm.length_mm, warm.uncertainty_mm), (100.0, None));
    }

    #[test]
    fn ten_values_determine_a_standard_deviation_within_half_of_it() {
        assert!((of_standard_deviation(3.0, 10) - 3.0 * 2.0 / 18f64.sqrt()).abs() < 1e-12);
    }
}
