//! Evaluates a plan on a cloud.

use optics::Calibration;
use rayon::prelude::*;
use scanning::Cloud;

use crate::evaluation::chain::Chain;
use crate::evaluation::fitted::{Fitted, fit_features};
use crate::evaluation::forms::{forms, retriangulation, sets};
use crate::evaluation::uncertainty::{self, Noise};
use crate::evaluation::values::{AngleAxes, State};
use crate::fitting::features::light_in_camera;
use crate::fitting::fitness;
use crate::fitting::sample::Samples;
use crate::interface::part_verdict::{CharacteristicKey, PartVerdict, part_verdict};
use crate::interface::request::MeasureError;
use crate::measuring::measure;
use crate::params::MIN_FEATURE_POINTS;
use crate::plan::document::Plan;
use crate::results::characteristics::CharacteristicEvaluator;
use crate::results::result::{CharacteristicResult, FeatureResult, PlanResult};
use crate::results::surface_profile::{Models, surface_profile};

/// Measures all characteristics of a plan on a cloud, each with value, uncertainty and verdict.
///
/// `calibration`: the one the scan was made with; without it no uncertainty is complete, and there is no verdict. `models`:
/// the nominal surfaces of the plan's surface profiles.
/// A feature or characteristic that fails is reported in its own result and does not affect the others.
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`MeasureError::CalibrationMismatch`], and [`MeasureError::TooFewPoints`] for a cloud with too few points.
pub fn evaluate(
    plan: &Plan,
    cloud: &Cloud,
    calibration: Option<&Calibration>,
    models: &Models,
) -> Result<PlanResult, MeasureError> {
    let samples = Samples::from_cloud(cloud, None, calibration.and_then(light_in_camera));
    if samples.len() < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: samples.len() });
    }
    let (fitted, alignment) = fit_features(plan, &samples);
    let mut chain = Chain::new(plan, &samples, fitted);
    let (forms, form_points) = forms(&chain);
    chain.sets = sets(&chain, &forms);
    let retriangulation = retriangulation(&chain, calibration)?;
    let base = chain.state(&chain.primitives(), form_points);
    chain.angles = plan
        .characteristics
        .iter()
        .map(|characteristic| {
            let nominal = characteristic.nominal_deg;
            AngleAxes::of(plan, &characteristic.measure, &base, nominal)
        })
        .collect();
    let noise = uncertainty::noise(&chain, retriangulation.as_ref());
    let by_noise = uncertainty::by_noise(&chain, &base, &noise);
    let by_modes = retriangulation.as_ref().map(|retriangulation| uncertainty::by_modes(&chain, retriangulation));
    let mut components = chain.components(&base, |_| true);
    for (component, correction) in components.iter_mut().zip(by_modes.iter().flat_map(|modes| &modes.corrections))
    {
        *component = component.map(|component| component + correction);
    }
    let features: Vec<FeatureResult> =
        (0..plan.features.len()).into_par_iter().map(|idx| feature_result(&chain, &base, &noise, idx)).collect();
    let evaluator =
        CharacteristicEvaluator { chain: &chain, base: &base, forms: &forms, features: &features, calibration };
    let characteristics: Vec<CharacteristicResult> = (0..plan.characteristics.len())
        .map(|idx| match surface_profile(plan, idx, cloud, calibration, models) {
            Some(result) => result,
            None => evaluator.characteristic(idx, components[idx].as_ref(), &by_noise[idx], by_modes.as_ref()),
        })
        .collect();
    Ok(PlanResult {
        verdict: verdict_of(plan, &characteristics),
        features,
        datum_from_part: base.datum_from_part,
        alignment_failure: alignment.and_then(Result::err),
        characteristics,
    })
}

/// The verdict on the part; invalid if a characteristic with limits has no verdict.
pub(crate) fn verdict_of(plan: &Plan, characteristics: &[CharacteristicResult]) -> PartVerdict {
    let required: Vec<CharacteristicKey<'_>> = plan
        .characteristics
        .iter()
        .filter(|c| c.lower.is_some() || c.upper.is_some())
        .map(|c| CharacteristicKey { tool: c.measure.name(), name: Some(&c.id) })
        .collect();
    let judged =
        characteristics.iter().map(|c| (CharacteristicKey { tool: c.measure, name: Some(&c.id) }, c.verdict));
    part_verdict(judged, &required).unwrap_or(PartVerdict::Invalid)
}

fn feature_result(chain: &Chain, base: &State, noise: &Noise, idx: usize) -> FeatureResult {
    let (feature, samples) = (&chain.plan.features[idx], chain.samples);
    let mut result = FeatureResult {
        id: feature.id.clone(),
        kind: feature.shape.name(),
        geometry: base.geometries[idx].map(|geometry| match &base.datum_from_part {
            Some(pose) => geometry.moved(pose),
            None => geometry,
        }),
        n_points: 0,
        n_left_out: 0,
        rms_mm: None,
        cloud_indices: Vec::new(),
        findings: Vec::new(),
        failure: None,
    };
    match &chain.fitted[idx] {
        Ok(Fitted::Surface(found)) => {
            let fitted = measure::fitted(samples, found);
            result.findings = fitness::findings(
                samples,
                std::slice::from_ref(found),
                std::slice::from_ref(&fitted),
                &noise.expected_mm[idx..=idx],
            );
            (result.n_points, result.n_left_out) = (fitted.n_points, fitted.n_outliers + fitted.n_border);
            result.rms_mm = Some(fitted.rms_mm);
            result.cloud_indices = fitted.cloud_indices;
        }
        Ok(Fitted::Rim(rim)) => {
            (result.n_points, result.n_left_out) = (rim.crossings.len(), rim.n_left_out);
            result.rms_mm = Some(rim.rms_mm);
            result.cloud_indices = rim.crossings.iter().map(|c| samples.cloud_idx(c.sample_idx)).collect();
            result.findings = rim.misfit(samples, feature.shape.name()).into_iter().collect();
        }
        Ok(Fitted::Section(indices)) => {
            result.n_points = indices.len();
            result.cloud_indices = indices.iter().map(|idx| samples.cloud_idx(*idx)).collect();
        }
        Ok(Fitted::Derived) if result.geometry.is_none() => {
            result.failure = Some(
                missing_below(chain, feature.shape.depends_on())
                    .unwrap_or(MeasureError::NotDetermined { what: result.kind }),
            );
        }
        Ok(Fitted::Derived) => {}
        Err(error) => result.failure = Some(error.clone()),
    }
    result
}

/// The error of the first of some features that failed.
fn missing_below(chain: &Chain, ids: Vec<&str>) -> Option<MeasureError> {
    ids.into_iter().find_map(|id| {
        let error = chain.fitted[chain.plan.feature_idx(id)?].as_ref().err()?;
        Some(MeasureError::Missing { id: id.to_owned(), reason: error.to_string() })
    })
}
