//! Results of characteristics: value, uncertainty and verdict from the components and their covariances, with missing
//! uncertainty contributions, findings against the features, and notes.

use nalgebra::{Matrix3, Vector3};
use optics::Calibration;

use crate::evaluation::chain::Chain;
use crate::evaluation::fitted::Fitted;
use crate::evaluation::forms::Form;
use crate::evaluation::uncertainty::Systematic;
use crate::evaluation::values::{AngleAxes, State, band, form_residuals};
use crate::interface::findings::{Finding, Missing};
use crate::interface::part_verdict::PartVerdict;
use crate::interface::request::MeasureError;
use crate::interface::verdict::Limits;
use crate::measuring::form::{Flatness, without_noise};
use crate::measuring::measure::verdict_if_proven;
use crate::measuring::missing::missing;
use crate::params::{COVERAGE_FACTOR, EXPANSION_PER_K, FOLD_SIGMAS, TEMPERATURE_SIGMA_K};
use crate::plan::characteristic::{Characteristic, Measure};
use crate::results::result::{CharacteristicResult, FeatureResult};

/// Computes the results of characteristics.
pub(crate) struct CharacteristicEvaluator<'a> {
    pub(crate) chain: &'a Chain<'a>,
    pub(crate) base: &'a State,
    pub(crate) forms: &'a [Form],
    pub(crate) features: &'a [FeatureResult],
    pub(crate) calibration: Option<&'a Calibration>,
}

impl CharacteristicEvaluator<'_> {
    pub(crate) fn characteristic(
        &self,
        idx: usize,
        components: Option<&Vector3<f64>>,
        noise: &Matrix3<f64>,
        modes: Option<&Systematic>,
    ) -> CharacteristicResult {
        let Characteristic { id, measure, nominal_mm, nominal_deg, lower, upper, attributes } =
            &self.chain.plan.characteristics[idx];
        let form = self.form(idx);
        let has_form = !measure.is_deviation() || matches!(measure, Measure::Position { .. }) || form.is_some();
        let angle = self.chain.angles[idx].as_ref();
        let systematic = modes.map(|modes| &modes.covariances[idx]);
        let estimate = components
            .filter(|_| has_form)
            .map(|components| value(measure, components, (noise, systematic), angle, form.as_ref()));
        let nominal = nominal_mm.or(*nominal_deg).or(measure.is_deviation().then_some(0.0));
        let error = estimate.as_ref().zip(nominal).map(|(estimate, nominal)| estimate.value - nominal);
        let limits = Limits { lower: *lower, upper: *upper };
        let missing = self.missing(idx, modes);
        let findings = self.findings(idx);
        let is_proven = missing.is_empty() && findings.is_empty();
        let u = estimate.as_ref().map(Estimate::expanded_uncertainty);
        let mut notes = estimate.as_ref().map_or_else(Vec::new, |estimate| estimate.notes.clone());
        notes.extend(missing.iter().map(|missing| format!("U is incomplete: it lacks {missing}")));
        notes.extend(findings.iter().map(|(id, finding)| format!("{id}: {finding}")));
        CharacteristicResult {
            id: id.clone(),
            measure: measure.name(),
            unit: measure.unit(),
            value: estimate.as_ref().map(|estimate| estimate.value),
            components: components
                .filter(|_| matches!(measure, Measure::Position { .. } | Measure::Angle { about: None, .. }))
                .map(|components| (*components).into()),
            nominal,
            limits,
            error,
            u_noise: estimate.as_ref().map(|estimate| estimate.u_noise),
            u_systematic: estimate.as_ref().and_then(|estimate| estimate.u_systematic),
            expanded_uncertainty: u,
            verdict: verdict(error.zip(u), &limits, is_proven),
            failure: estimate.is_none().then(|| self.failure(idx)),
            comparison: None,
            invalid_because: None,
            missing,
            findings,
            notes,
            attributes: attributes.clone(),
        }
    }

    /// The form of a characteristic, corrected for noise.
    fn form(&self, idx: usize) -> Option<Flatness> {
        let form = self.forms.iter().find(|form| form.characteristic == idx)?;
        let measure = &self.chain.plan.characteristics[idx].measure;
        let samples = self.chain.samples;
        let positions: Vec<Vector3<f64>> = form.inliers.iter().map(|idx| samples.position(*idx)).collect();
        let residuals = match measure {
            // Relative to the least-squares plane of all points.
            Measure::Flatness { .. } => positions.iter().map(|at| form.shape.distance_mm(at)).collect(),
            _ => form_residuals(self.chain.plan, measure, self.base, &positions)?,
        };
        Some(without_noise(samples, (&form.inliers, &form.shape), &residuals, |residuals| {
            band(measure, residuals)
        }))
    }

    fn failure(&self, idx: usize) -> MeasureError {
        let measure = &self.chain.plan.characteristics[idx].measure;
        let of_features =
            (0..self.features.len()).filter(|feature| self.chain.depends_on(idx, *feature)).find_map(|feature| {
                let reason = self.features[feature].failure.as_ref()?.to_string();
                Some(MeasureError::Missing { id: self.features[feature].id.clone(), reason })
            });
        of_features.unwrap_or(MeasureError::NotDetermined { what: measure.name() })
    }

    fn findings(&self, idx: usize) -> Vec<(String, Finding)> {
        let resting = self.features.iter().enumerate().filter(|(feature, _)| self.chain.depends_on(idx, *feature));
        resting.flat_map(|(_, feature)| feature.findings.iter().map(|f| (feature.id.clone(), f.clone()))).collect()
    }

    /// Uncertainty contributions that U lacks.
    fn missing(&self, idx: usize, modes: Option<&Systematic>) -> Vec<Missing> {
        let chain = self.chain;
        let has_unknown_threshold = |(feature, fitted): (usize, &Result<Fitted, MeasureError>)| {
            let has_no_threshold = matches!(fitted, Ok(Fitted::Rim(rim)) if rim.threshold_mm.is_none());
            chain.depends_on(idx, feature) && has_no_threshold
        };
        let measure = &chain.plan.characteristics[idx].measure;
        let mut missing = missing(chain.samples, self.calibration, measure.may_span_travel());
        if modes.is_some_and(|modes| modes.has_failed[idx]) {
            missing.push(Missing::CalibrationModes);
        }
        if chain.fitted.iter().enumerate().any(has_unknown_threshold) {
            missing.push(Missing::EdgeThreshold);
        }
        missing
    }
}

/// A value with its standard uncertainties, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) u_noise: f64,
    pub(crate) u_systematic: Option<f64>,
    pub(crate) notes: Vec<String>,
}

impl Estimate {
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
) -> Estimate {
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
                    "the angle of {folded:.5}° is little larger than its uncertainty, which can only increase an angle; it \
                     was corrected for this bias: see the signed tilts"
                ));
                folded = (folded * folded - square).max(0.0).sqrt();
                if total[(1, 1)] > total[(0, 0)] {
                    axis = Vector3::y();
                }
            }
            let (u_noise, u_systematic) = both(1.0, &axis);
            let value = if is_supplement { 180.0 - folded } else { folded };
            Estimate { value, u_noise, u_systematic, notes }
        }
        Measure::Position { at_mm, .. } => {
            let (deviation, square) = (components.norm(), total.trace());
            let mut notes = Vec::new();
            let (value, direction) = if deviation * deviation <= FOLD_SIGMAS * FOLD_SIGMAS * square {
                notes.push(format!(
                    "the position deviates by {deviation:.4} mm, little more than its uncertainty, which can only increase \
                     the deviation; it was corrected for this bias: see the signed components"
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
            Estimate { value, u_noise, u_systematic: u_systematic.map(warm), notes }
        }
        _ => {
            let (u_noise, u_systematic) = both(1.0, &Vector3::x());
            match form {
                Some(form) => Estimate {
                    value: form.value_mm,
                    u_noise: u_noise.hypot(form.standard_uncertainty_mm),
                    u_systematic,
                    notes: vec![format!(
                        "no filter: 99.9 % of the points ({:.0} with independent noise) lie in a zone of {:.4} mm, noise alone \
                         gives {:.4} mm; RMS without noise {:.4} mm",
                        form.n_independent, form.band_mm, form.noise_band_mm, form.form_rms_mm
                    )],
                },
                None => {
                    let is_length = measure.unit() == crate::interface::measurement::Unit::Mm;
                    let grown =
                        if is_length { components.x.abs() * EXPANSION_PER_K * TEMPERATURE_SIGMA_K } else { 0.0 };
                    let u_systematic = u_systematic.map(|u| u.hypot(grown));
                    Estimate { value: components.x, u_noise, u_systematic, notes: Vec::new() }
                }
            }
        }
    }
}

/// The verdict on a characteristic: `None` without limits, invalid without a finite value and uncertainty, undecided unless
/// `is_proven` (U is complete and the model fits).
pub(crate) fn verdict(error_and_u: Option<(f64, f64)>, limits: &Limits, is_proven: bool) -> Option<PartVerdict> {
    limits.width()?;
    let finite = error_and_u.filter(|(error, u)| error.is_finite() && u.is_finite());
    Some(finite.map_or(PartVerdict::Invalid, |(error, u)| verdict_if_proven(error, limits, u, is_proven).into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_non_finite_value_is_invalid_and_a_value_without_limits_has_no_verdict() {
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
