//! One measurement, from the cloud to the verdict.

use nalgebra::Vector3;
use optics::Calibration;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use scanning::Cloud;

use crate::fitting::features::{FeatureFit, Search, light_in_camera};
use crate::fitting::fitness::findings;
use crate::fitting::orders;
use crate::fitting::sample::Samples;
use crate::interface::measurement::{FittedFeature, Measurement, Unit};
use crate::interface::request::{MeasureError, MeasureRequest, Tool};
use crate::interface::shape::{Shape, across};
use crate::interface::verdict::{Limits, Verdict, verdict};
use crate::measuring::budget::{Budget, budget};
use crate::measuring::find::find;
use crate::measuring::form::flatness;
use crate::measuring::systematic::Retriangulation;
use crate::measuring::value::{FirstPoints, turn_rad, value};
use crate::params::{COVERAGE_FACTOR, FOLD_SIGMAS, MAX_RADIUS_UNCERTAINTY, MIN_FEATURE_POINTS};

/// The quantity to measure: a tool, and for an angle its side and axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measurand {
    pub(crate) tool: Tool,
    pub(crate) supplement: bool,
    /// Unit vector about which an angle is measured with its sign, so that it does not fold at 0°; if `None`, the angle
    /// is unsigned.
    pub(crate) turn: Option<Vector3<f64>>,
}

/// Measures a feature in a cloud.
///
/// `calibration`: the one the scan was made with. It determines the systematic part of the uncertainty and the position
/// of the light source, which selects the points of a curved feature: without it the value of a sphere or a cylinder
/// may differ within its uncertainty, the uncertainty is incomplete, and there is no verdict. The result depends
/// neither on the number of threads nor on the stage's zero.
///
/// # Errors
/// [`MeasureError`]: no such feature, too few points, a radius that the points do not determine, or a calibration that
/// does not belong to the cloud.
pub fn measure(
    cloud: &Cloud,
    calibration: Option<&Calibration>,
    request: &MeasureRequest,
) -> Result<Measurement, MeasureError> {
    check(request)?;
    let samples = Samples::from_cloud(cloud, request.region.as_ref(), calibration.and_then(light_in_camera));
    if samples.len() < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: samples.len() });
    }
    let mut notes = Vec::new();
    let mut search = Search { samples: &samples, rng: Pcg64Mcg::seed_from_u64(request.seed) };
    let features = find(&mut search, request, &mut notes)?;
    let (measurand, mut measured) = read_value(&samples, &features, request)?;
    let retriangulation =
        calibration.map(|calibration| Retriangulation::new(&samples, &features, calibration)).transpose()?;
    let evaluate = |measurand: &Measurand, value: f64, notes: &mut Vec<String>| {
        budget((&samples, &features), measurand, value, (calibration, retriangulation.as_ref()), notes)
            .ok_or(MeasureError::FeatureNotFound { feature: request.tool.name(), n_points: samples.len() })
    };
    let mut budget = evaluate(&measurand, measured, &mut notes)?;
    measured += budget.correction;
    let tilts_deg = tilts_deg(&features, request.tool);
    if request.tool == Tool::Angle {
        let across = Measurand { turn: measurand.turn.map(|turn| second_axis(&features, &turn)), ..measurand };
        let other = evaluate(&across, measured, &mut Vec::new())?;
        measured = unfolded(measured, &measurand, &mut budget, &other, &mut notes);
    }
    if request.tool == Tool::Flatness {
        let flatness = flatness(&samples, &features[0]);
        measured = flatness.value_mm;
        budget.u_noise = flatness.standard_uncertainty_mm;
        notes.push(format!(
            "flatness about the least-squares plane of all {} points ({:.0} with independent noise), no filter: 99.9 % \
             lie in a band of {:.4} mm, noise alone gives {:.4} mm; RMS without noise {:.4} mm",
            features[0].inliers.len(),
            flatness.n_independent,
            flatness.band_mm,
            flatness.noise_band_mm,
            flatness.form_rms_mm
        ));
    }
    let standard = budget.u_noise.hypot(budget.u_systematic.unwrap_or(0.0));
    check_radius(&measurand, measured, standard)?;
    describe(&features, &mut notes);
    let fitted: Vec<FittedFeature> = features.iter().map(|feature| fitted(&samples, feature)).collect();
    let findings = findings(&samples, &features, &fitted, &budget.expected_mm);
    notes.extend(budget.missing.iter().map(|missing| format!("U is incomplete: it lacks {missing}")));
    notes.extend(findings.iter().map(ToString::to_string));

    let expanded_uncertainty = COVERAGE_FACTOR * standard;
    let nominal = request.nominal_mm.or((request.tool == Tool::Flatness).then_some(0.0));
    let error = nominal.map(|nominal| measured - nominal);
    let (errors, per_order) = orders::table(&samples, request.tool, &features, nominal.unwrap_or(measured));
    let is_proven = budget.missing.is_empty() && findings.is_empty();
    let judged = |(error, tolerance)| {
        verdict_if_proven(error, &Limits::symmetric(tolerance), expanded_uncertainty, is_proven)
    };
    Ok(Measurement {
        tool: request.tool,
        features: fitted,
        value: measured,
        unit: if request.tool == Tool::Angle { Unit::Degree } else { Unit::Mm },
        tilts_deg,
        nominal,
        error,
        u_noise: budget.u_noise,
        u_systematic: budget.u_systematic,
        expanded_uncertainty,
        tolerance: request.tolerance_mm,
        verdict: error.zip(request.tolerance_mm).map(judged),
        missing: budget.missing,
        findings,
        errors,
        per_order,
        notes,
    })
}

/// The verdict; decided only if `is_proven`: the uncertainty is complete and the model fits.
pub(crate) fn verdict_if_proven(error: f64, limits: &Limits, uncertainty: f64, is_proven: bool) -> Verdict {
    if is_proven { verdict(error, limits, uncertainty) } else { Verdict::Undecided }
}

fn check(request: &MeasureRequest) -> Result<(), MeasureError> {
    if let Some(value) = request.nominal_mm.filter(|v| !v.is_finite()) {
        return Err(MeasureError::BadNumber { name: "the nominal value", value, condition: "" });
    }
    if let Some(value) = request.tolerance_mm.filter(|v| !(v.is_finite() && *v > 0.0)) {
        return Err(MeasureError::BadNumber { name: "the tolerance", value, condition: " above zero" });
    }
    Ok(())
}

/// The value, and for an angle its side and axis.
fn read_value(
    samples: &Samples,
    features: &[FeatureFit],
    request: &MeasureRequest,
) -> Result<(Measurand, f64), MeasureError> {
    let shapes: Vec<Shape> = features.iter().map(|f| f.shape).collect();
    let inliers = &features[0].inliers;
    let first = FirstPoints {
        positions: inliers.iter().map(|&idx| samples.position(idx)).collect(),
        camera: samples.mean_camera(inliers),
    };
    let turn = (request.tool == Tool::Angle).then(|| axis_of_turn(features)).flatten();
    let measurand = Measurand { tool: request.tool, supplement: false, turn };
    let direct = value(&measurand, &shapes, &first)
        .ok_or(MeasureError::FeatureNotFound { feature: request.tool.name(), n_points: samples.len() })?;
    let mirrored = 180.0 - direct;
    let supplement = request.tool == Tool::Angle
        && request.nominal_mm.is_some_and(|nominal| (mirrored - nominal).abs() < (direct - nominal).abs());
    Ok((Measurand { supplement, ..measurand }, if supplement { mirrored } else { direct }))
}

/// The normals of two faces.
fn normals(features: &[FeatureFit]) -> Option<(Vector3<f64>, Vector3<f64>)> {
    match features {
        [
            FeatureFit { shape: Shape::Plane { normal: a, .. }, .. },
            FeatureFit { shape: Shape::Plane { normal: b, .. }, .. },
        ] => Some((*a, *b)),
        _ => None,
    }
}

/// The axis about which the second face is rotated relative to the first; any axis in the first if they are parallel.
fn axis_of_turn(features: &[FeatureFit]) -> Option<Vector3<f64>> {
    let (a, b) = normals(features)?;
    Some(turn_rad(&a, &b).try_normalize(f64::MIN_POSITIVE).unwrap_or_else(|| across(&a)[0]))
}

/// The axis in the first face perpendicular to the axis of rotation.
fn second_axis(features: &[FeatureFit], turn: &Vector3<f64>) -> Vector3<f64> {
    normals(features).map_or(*turn, |(a, _)| a.cross(turn).normalize())
}

/// Rotation of the second face relative to the first about x and y of the part frame, degrees, signed.
fn tilts_deg(features: &[FeatureFit], tool: Tool) -> Option<[f64; 2]> {
    let (a, b) = normals(features).filter(|_| tool == Tool::Angle)?;
    let turn = turn_rad(&a, &b);
    Some([turn.x.to_degrees(), turn.y.to_degrees()])
}

/// An angle near 0° corrected for noise, which can only increase it: √(θ² − u₁² − u₂²); its uncertainty is then the
/// larger of those about the two axes.
fn unfolded(
    angle: f64,
    measurand: &Measurand,
    budget: &mut Budget,
    other: &Budget,
    notes: &mut Vec<String>,
) -> f64 {
    let square = |budget: &Budget| budget.u_noise.powi(2) + budget.u_systematic.unwrap_or(0.0).powi(2);
    let (along, across) = (square(budget), square(other));
    let folded = if measurand.supplement { 180.0 - angle } else { angle };
    if folded * folded > FOLD_SIGMAS * FOLD_SIGMAS * (along + across) {
        return angle;
    }
    if across > along {
        (budget.u_noise, budget.u_systematic) = (other.u_noise, other.u_systematic);
    }
    notes.push(format!(
        "the angle of {folded:.5}° is little larger than its uncertainty, which can only increase an angle; it was corrected \
         for this bias: see the signed tilts about x and y"
    ));
    let without = (folded * folded - along - across).max(0.0).sqrt();
    if measurand.supplement { 180.0 - without } else { without }
}

/// Refuses a radius that the points do not determine.
fn check_radius(measurand: &Measurand, radius_mm: f64, standard_mm: f64) -> Result<(), MeasureError> {
    let is_radius = matches!(measurand.tool, Tool::Sphere | Tool::Cylinder);
    if is_radius && standard_mm > MAX_RADIUS_UNCERTAINTY * radius_mm {
        return Err(MeasureError::RadiusUndetermined { radius_mm, u_mm: standard_mm });
    }
    Ok(())
}

/// Adds notes on the features.
fn describe(features: &[FeatureFit], notes: &mut Vec<String>) {
    for feature in features.iter().filter(|feature| !feature.border_trimmed) {
        notes.push(format!("{}: too small or too coarsely sampled to exclude its border", feature.role));
    }
}

pub(crate) fn fitted(samples: &Samples, feature: &FeatureFit) -> FittedFeature {
    let square: f64 =
        feature.inliers.iter().map(|&idx| feature.shape.distance_mm(&samples.position(idx)).powi(2)).sum();
    FittedFeature {
        role: feature.role,
        shape: feature.shape,
        n_points: feature.inliers.len(),
        n_outliers: feature.n_outliers,
        n_border: feature.n_border,
        rms_mm: (square / feature.inliers.len() as f64).sqrt(),
        cloud_indices: feature.inliers.iter().map(|&idx| samples.cloud_idx(idx)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_radius_known_worse_than_to_a_tenth_is_refused() {
        let asks = |tool| Measurand { tool, supplement: false, turn: None };
        assert!(check_radius(&asks(Tool::Sphere), 20.0, 1.9).is_ok());
        let refused = check_radius(&asks(Tool::Cylinder), 20.0, 2.1);
        assert!(matches!(refused, Err(MeasureError::RadiusUndetermined { .. })), "{refused:?}");
        assert!(check_radius(&asks(Tool::Step), 0.01, 0.02).is_ok());
    }
}
