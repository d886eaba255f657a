//! Goodness of fit: whether the model fits the points.

use nalgebra::Vector3;

use crate::fitting::features::FeatureFit;
use crate::fitting::sample::Samples;
use crate::interface::findings::Finding;
use crate::interface::measurement::FittedFeature;
use crate::interface::shape::Shape;
use crate::params::{
    ARC_TAIL_FRACTION, FORM_RMS_RELATIVE, MAX_OFF_SURFACE_FRACTION, MAX_RESIDUAL_RATIO, MIN_ARC_DEG,
};

/// Findings against the fitted features. `expected_mm`: the RMS of each along its normal predicted from the noise.
pub(crate) fn findings(
    samples: &Samples,
    found: &[FeatureFit],
    fitted: &[FittedFeature],
    expected_mm: &[f64],
) -> Vec<Finding> {
    let mut findings = Vec::new();
    for ((found, fitted), expected_mm) in found.iter().zip(fitted).zip(expected_mm) {
        let role = fitted.role;
        let form_mm = FORM_RMS_RELATIVE * samples.mean_distance_mm(&found.inliers);
        let allowed_mm = (MAX_RESIDUAL_RATIO * expected_mm).hypot(form_mm);
        if samples.sigma_known && fitted.rms_mm > allowed_mm {
            findings.push(Finding::ModelMisfit { role, rms_mm: fitted.rms_mm, allowed_mm });
        }
        let fraction = fitted.n_outliers as f64 / (fitted.n_points + fitted.n_outliers) as f64;
        if fraction > MAX_OFF_SURFACE_FRACTION {
            findings.push(Finding::OffSurface { role, fraction });
        }
        if let Some(arc_deg) = arc_deg(samples, found).filter(|arc_deg| *arc_deg < MIN_ARC_DEG) {
            findings.push(Finding::ShortArc { role, arc_deg });
        }
    }
    findings
}

/// Angle between the outermost normals of a curved feature, degrees; `None` for a plane.
fn arc_deg(samples: &Samples, feature: &FeatureFit) -> Option<f64> {
    if matches!(feature.shape, Shape::Plane { .. }) {
        return None;
    }
    let normals: Vec<Vector3<f64>> =
        feature.inliers.iter().map(|&idx| feature.shape.normal_at(&samples.position(idx))).collect();
    let mean = normals.iter().sum::<Vector3<f64>>().try_normalize(f64::MIN_POSITIVE)?;
    let mut cosines: Vec<f64> = normals.iter().map(|normal| normal.dot(&mean)).collect();
    cosines.sort_unstable_by(f64::total_cmp);
    let outermost = cosines[(ARC_TAIL_FRACTION * cosines.len() as f64) as usize];
    Some(2.0 * outermost.clamp(-1.0, 1.0).acos().to_degrees())
}
