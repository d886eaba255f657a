//! Surface profiles: deviations of a cloud from CAD models, as characteristics of a plan.

use std::collections::HashMap;

use optics::Calibration;
use scanning::Cloud;

use crate::cad::compare::compare;
use crate::cad::comparison::{AlignTo, CompareRequest, Comparison};
use crate::cad::nominal::Nominal;
use crate::interface::request::MeasureError;
use crate::plan::characteristic::{Characteristic, Measure};
use crate::plan::document::Plan;
use crate::results::characteristics::{Estimate, verdict};
use crate::results::no_verdict::not_measured;
use crate::results::result::CharacteristicResult;

/// Nominal surfaces by the SHA-256 of their files.
pub type Models = HashMap<String, Nominal>;

/// The result of a characteristic if it is a surface profile.
pub(crate) fn surface_profile(
    plan: &Plan,
    idx: usize,
    cloud: &Cloud,
    calibration: Option<&Calibration>,
    models: &Models,
) -> Option<CharacteristicResult> {
    let characteristic = &plan.characteristics[idx];
    let Measure::SurfaceProfile { model, best_fit, start, region, reach_mm } = &characteristic.measure else {
        return None;
    };
    let align = match (&plan.alignment, best_fit) {
        (Some(_), false) => AlignTo::Datums(Box::new(plan.clone())),
        (Some(_), true) => AlignTo::DatumsThenSurface(Box::new(plan.clone())),
        (None, _) => AlignTo::surface_near(start.unwrap_or_default()),
    };
    let request = CompareRequest {
        align,
        // The zone is as wide as twice the deviation permitted to either side.
        tolerance_mm: characteristic.upper.map(|upper| upper / 2.0),
        reach_mm: *reach_mm,
        capture_mm: None,
        region: None,
        surface_region: *region,
    };
    let missing = || MeasureError::ModelMissing { name: model.name.clone() };
    let nominal = models.get(&model.sha256.to_ascii_lowercase()).ok_or_else(missing);
    let compared = nominal.and_then(|nominal| compare(cloud, calibration, nominal, &request));
    Some(match compared {
        Ok(comparison) => result(characteristic, comparison, calibration.is_some()),
        Err(error) => not_measured(characteristic, &error),
    })
}

fn result(characteristic: &Characteristic, comparison: Comparison, is_calibrated: bool) -> CharacteristicResult {
    let nothing = MeasureError::NotDetermined { what: "largest deviation" };
    let mut result = not_measured(characteristic, &nothing);
    let estimate = comparison.largest.map(|largest| Estimate {
        value: 2.0 * largest.deviation_mm,
        u_noise: 2.0 * largest.u_noise_mm,
        u_systematic: is_calibrated.then_some(2.0 * largest.u_shared_mm),
        notes: Vec::new(),
    });
    if let Some(estimate) = estimate {
        let u = estimate.expanded_uncertainty();
        result.value = Some(estimate.value);
        result.error = Some(estimate.value);
        result.u_noise = Some(estimate.u_noise);
        result.u_systematic = estimate.u_systematic;
        result.expanded_uncertainty = Some(u);
        result.verdict = verdict(Some((estimate.value, u)), &result.limits, comparison.missing.is_empty());
        result.failure = None;
    }
    result.notes.push(covered(&comparison));
    if let Some(largest) = comparison.largest {
        result
            .notes
            .push(format!("corrected for noise, which adds {:.4} mm to the largest deviation", largest.noise_mm));
    }
    result.notes.extend(comparison.notes.iter().cloned());
    result.missing.clone_from(&comparison.missing);
    result.comparison = Some(Box::new(comparison));
    result
}

fn covered(comparison: &Comparison) -> String {
    let statistics = &comparison.statistics;
    format!(
        "the points cover {:.0} of {:.0} mm² of the surface ({:.0} %), which is what the verdict concerns; RMS {:.4} mm",
        statistics.covered_mm2,
        statistics.area_mm2,
        100.0 * statistics.covered_mm2 / statistics.area_mm2,
        statistics.rms_mm
    )
}
