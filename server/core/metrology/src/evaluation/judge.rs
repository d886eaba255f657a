//! From the components of a characteristic and how they vary to value, uncertainty and verdict.

use nalgebra::{Matrix3, Vector3};

use crate::evaluation::values::AngleAxes;
use crate::interface::part_verdict::PartVerdict;
use crate::interface::verdict::Limits;
use crate::measuring::form::Flatness;
use crate::measuring::measure::judged;
use crate::params::{COVERAGE_FACTOR, EXPANSION_PER_K, FOLD_SIGMAS, TEMPERATURE_SIGMA_K};
use crate::plan::characteristic::Measure;

/// A value with its standard uncertainties, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Judged {
    pub(crate) value: f64,
    pub(crate) u_noise: f64,
    pub(crate) u_systematic: Option<f64>,
    pub(crate) notes: Vec<String>,
}

impl Judged {
    pub(crate) fn expanded_uncertainty(&self) -> f64 {
        COVERAGE_FACTOR * self.u_noise.hypot(self.u_systematic.unwrap_or(0.0))
    }
}

/// Value and uncertainties of a characteristic from its components and their covariances.
pub(crate) fn value(
    measure: &Measure,
    components: &Vector3<f64>,
    (noise, systematic): (&Matrix3<f64>, Option<&Matrix3<f64>>),
    angle: Option<&AngleAxes>,
    form: Option<&Flatness>,
) -> Judged {
    let along = |covariance: &Matrix3<f64>, direction: &Vector3<f64>| {
        (direction.transpose() * covariance * direction)[(0, 0)].max(0.0).sqrt()
    };
    let both = |scale: f64, direction: &Vector3<f64>| {
        (scale * along(noise, direction), systematic.map(|systematic| scale * along(systematic, direction)))
    };
    let total = noise + systematic.copied().unwrap_or_else(Matrix3::zeros);
    match measure {
        Measure::Angle { about: None, .. } => {
            let is_supplement = angle.is_some_and(AngleAxes::is_supplement);
            let (mut folded, square) = (components.norm(), total.trace());
            let mut axis = Vector3::x();
            let mut notes = Vec::new();
            if folded * folded <= FOLD_SIGMAS * FOLD_SIGMAS * square {
                notes.push(format!(
                    "the features are turned by {folded:.5}°, little more than the uncertainty, which can only make an \
                     angle larger; its share was taken out: see the tilts, which have a sign"
                ));
                folded = (folded * folded - square).max(0.0).sqrt();
                if total[(1, 1)] > total[(0, 0)] {
                    axis = Vector3::y();
                }
            }
            let (u_noise, u_systematic) = both(1.0, &axis);
            let value = if is_supplement { 180.0 - folded } else { folded };
            Judged { value, u_noise, u_systematic, notes }
        }
        Measure::Position { at_mm, .. } => {
            let (deviation, square) = (components.norm(), total.trace());
            let mut notes = Vec::new();
            let (value, direction) = if deviation * deviation <= FOLD_SIGMAS * FOLD_SIGMAS * square {
                notes.push(format!(
                    "the place is off by {deviation:.4} mm, little more than the uncertainty, which can only make it \
                     larger; its share was taken out: see the deviations, which have signs"
                ));
                let eigen = total.symmetric_eigen();
                let worst = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
                (2.0 * (deviation * deviation - square).max(0.0).sqrt(), worst)
            } else {
                (2.0 * deviation, components / deviation)
            };
            let (u_noise, u_systematic) = both(2.0, &direction);
            let reach_mm = at_mm.iter().flatten().map(|mm| mm * mm).sum::<f64>().sqrt();
            let warm = |u: f64| u.hypot(2.0 * reach_mm * EXPANSION_PER_K * TEMPERATURE_SIGMA_K);
            Judged { value, u_noise, u_systematic: u_systematic.map(warm), notes }
        }
        _ => {
            let (u_noise, u_systematic) = both(1.0, &Vector3::x());
            match form {
                Some(form) => Judged {
                    value: form.value_mm,
                    u_noise: u_noise.hypot(form.standard_uncertainty_mm),
                    u_systematic,
                    notes: vec![format!(
                        "no filter: 99.9 % of the points ({:.0} with noise of their own) lie in a zone of {:.4} mm, of \
                         which noise alone has {:.4} mm; RMS without noise {:.4} mm",
                        form.n_independent, form.band_mm, form.noise_band_mm, form.form_rms_mm
                    )],
                },
                None => {
                    let is_length = measure.unit() == crate::interface::measurement::Unit::Mm;
                    let grown =
                        if is_length { components.x.abs() * EXPANSION_PER_K * TEMPERATURE_SIGMA_K } else { 0.0 };
                    let u_systematic = u_systematic.map(|u| u.hypot(grown));
                    Judged { value: components.x, u_noise, u_systematic, notes: Vec::new() }
                }
            }
        }
    }
}

/// The verdict on a characteristic: none without limits, invalid without a finite value and a finite uncertainty, undecided
/// unless U is complete and the model fits.
pub(crate) fn verdict(error_and_u: Option<(f64, f64)>, limits: &Limits, is_proven: bool) -> Option<PartVerdict> {
    limits.width()?;
    let finite = error_and_u.filter(|(error, u)| error.is_finite() && u.is_finite());
    Some(finite.map_or(PartVerdict::Invalid, |(error, u)| judged(error, limits, u, is_proven).into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_invalid_and_what_is_not_asked_has_no_verdict() {
        let limits = Limits { lower: Some(-0.1), upper: None };
        assert_eq!(verdict(None, &limits, true), Some(PartVerdict::Invalid));
        assert_eq!(verdict(Some((f64::NAN, 0.01)), &limits, true), Some(PartVerdict::Invalid));
        assert_eq!(verdict(Some((0.0, f64::INFINITY)), &limits, true), Some(PartVerdict::Invalid));
        assert_eq!(verdict(Some((0.0, 0.01)), &limits, true), Some(PartVerdict::Ok));
        assert_eq!(verdict(Some((0.0, 0.01)), &limits, false), Some(PartVerdict::Undecided));
        assert_eq!(verdict(Some((-9.0, 0.01)), &limits, false), Some(PartVerdict::Undecided));
        assert_eq!(verdict(Some((0.0, 0.01)), &Limits { lower: None, upper: None }, true), None);
    }
}
