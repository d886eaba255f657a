//! Uncertainty from the noise of the points.
//!
//! Points of one line share their noise over several columns, and frames their speckle over several steps, so their
//! information is divided by (correlation length) / (spacing) along both. Residuals larger than predicted increase the
//! uncertainty, smaller ones do not reduce it (Birge's ratio, one-sided); if the cloud has no σ, the residuals alone
//! determine it.

use optics::{RotaryAxis, Stage};
use scanning::Cloud;
use statistics::median;

use crate::fitting::features::FeatureFit;
use crate::fitting::fit::{Matrix, Vector, covariance};
use crate::fitting::robust::Near;
use crate::fitting::sample::Samples;
use crate::interface::shape::{MAX_PARAMETERS, Shape};
use crate::measuring::measure::Measurand;
use crate::measuring::value::{FirstPoints, value};
use crate::params::{NOISE_CORRELATION_KEY, NOISE_CORRELATION_PX, SPECKLE_SUM};

/// Step of the numerical derivatives of a value with respect to a shape's parameters (mm or rad).
const DERIVATIVE_STEP: f64 = 1e-6;

/// Noise of the points of one feature.
pub(crate) struct FeatureNoise {
    /// Standard deviation along the ray of every inlier, mm.
    pub(crate) sigma_mm: Vec<f64>,
}

/// Effect of the noise on a value.
pub(crate) struct NoiseResult {
    pub(crate) standard_uncertainty: f64,
    /// Largest ratio of residuals to predicted noise over the features.
    pub(crate) ratio: f64,
    /// RMS along the normal predicted from the noise, of every feature, mm.
    pub(crate) expected_mm: Vec<f64>,
}

/// Columns over which noise is shared, from the cloud's comments.
pub(crate) fn correlation_px(cloud: &Cloud) -> f64 {
    cloud
        .comments
        .iter()
        .find_map(|comment| comment.trim().strip_prefix(NOISE_CORRELATION_KEY)?.trim().parse().ok())
        .filter(|px: &f64| px.is_finite() && *px > 0.0)
        .unwrap_or(NOISE_CORRELATION_PX)
}

/// Number of points with the information of one independent point: neighbours on a line share the image's noise, and
/// frames closer together than the light sheet's thickness show nearly the same speckle (eq. 4, 5).
pub(crate) fn redundancy(samples: &Samples, inliers: &[u32]) -> f64 {
    let mut spacings: Vec<f64> = inliers
        .windows(2)
        .filter_map(|pair| spacing_px(samples, pair[0], pair[1]).filter(|px| *px > 0.0))
        .collect();
    let spacing_px = median(&mut spacings).unwrap_or(1.0);
    (correlation_px(samples.cloud) / spacing_px).max(1.0) * speckle_redundancy(samples, inliers)
}

/// Distance of two points of one line in the image, px; `None` if they are on different lines.
pub(crate) fn spacing_px(samples: &Samples, first: u32, second: u32) -> Option<f64> {
    let [a, b] = [first, second].map(|idx| samples.point(idx));
    let same_line = a.frame == b.frame && a.order == b.order;
    same_line.then(|| f64::from((a.u_px - b.u_px).abs().max((a.v_px - b.v_px).abs())))
}

/// Number of frames with the same speckle; 1 if the stage's steps or the sheet's thickness are unknown.
pub(crate) fn speckle_redundancy(samples: &Samples, inliers: &[u32]) -> f64 {
    let (Some(stage), Some(line_sigma_mm)) = (&samples.stage, samples.line_sigma_mm) else { return 1.0 };
    let positions = stage.positions.iter().map(|position| position.value());
    let (low, high) =
        positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let n_frames = stage.positions.len() as f64;
    let travel_mm = match &stage.stage {
        Stage::Linear(axis) => (high - low) * axis.direction.norm(),
        Stage::Rotary(axis) => (high - low).to_radians() * radius_mm(axis, samples, inliers),
    };
    let of_one = SPECKLE_SUM * line_sigma_mm * (n_frames - 1.0) / travel_mm;
    if n_frames < 2.0 { 1.0 } else { of_one.clamp(1.0, n_frames) }
}

/// Median distance of the points from the rotation axis, which is the same in the part and camera frames.
fn radius_mm(axis: &RotaryAxis, samples: &Samples, inliers: &[u32]) -> f64 {
    let mut radii: Vec<f64> = inliers.iter().map(|&idx| axis.radius_mm(&samples.position(idx))).collect();
    median(&mut radii).unwrap_or(0.0)
}

/// Propagates the noise of the points to the value of a tool.
pub(crate) fn propagate(
    samples: &Samples,
    measurand: &Measurand,
    features: &[FeatureFit],
    noises: &[FeatureNoise],
) -> Option<NoiseResult> {
    let mut variance = 0.0;
    let mut ratio: f64 = 0.0;
    let mut expected_mm = Vec::with_capacity(features.len());
    for (idx, (feature, noise)) in features.iter().zip(noises).enumerate() {
        let (covariance, birge, expected) =
            shape_covariance(samples, (&feature.inliers, &feature.inliers), &feature.shape, noise);
        expected_mm.push(expected);
        ratio = ratio.max(birge);
        let gradient = value_gradient(samples, measurand, features, idx)?;
        variance += gradient.dot(&(covariance? * gradient));
    }
    Some(NoiseResult { standard_uncertainty: variance.max(0.0).sqrt(), ratio, expected_mm })
}

/// Covariance of a shape's parameters from the noise of its points, the ratio of residuals to predicted noise, and the RMS
/// along the normal predicted from the noise, mm. `few`: the subset of `inliers` that is evaluated, each with its `noise`.
pub(crate) fn shape_covariance(
    samples: &Samples,
    (inliers, few): (&[u32], &[u32]),
    shape: &Shape,
    noise: &FeatureNoise,
) -> (Option<Matrix>, f64, f64) {
    let along_normal: Vec<f64> =
        few.iter().zip(&noise.sigma_mm).map(|(&idx, sigma_mm)| sigma_mm * samples.at(idx).cosine(shape)).collect();
    let expected_mm = (along_normal.iter().map(|s| s * s).sum::<f64>() / along_normal.len() as f64).sqrt();
    let sum: f64 = few
        .iter()
        .zip(&along_normal)
        .map(|(&idx, sigma)| (shape.distance_mm(&samples.position(idx)) / sigma).powi(2))
        .sum();
    let freedom = few.len().saturating_sub(shape.parameters()).max(1);
    let birge = (sum / freedom as f64).sqrt();
    let scale = if samples.sigma_known { birge.max(1.0) } else { birge };
    let redundancy = redundancy(samples, inliers) * few.len() as f64 / inliers.len() as f64;
    let variances: Vec<f64> = along_normal.iter().map(|s| s * s * scale * scale * redundancy).collect();
    (covariance(shape, &Near { samples, indices: few, shape }, &variances), birge, expected_mm)
}

fn value_gradient(
    samples: &Samples,
    measurand: &Measurand,
    features: &[FeatureFit],
    moved: usize,
) -> Option<Vector> {
    let first = FirstPoints { positions: Vec::new(), camera: samples.mean_camera(&features[0].inliers) };
    let mut shapes: Vec<Shape> = features.iter().map(|f| f.shape).collect();
    let mut gradient = Vector::zeros();
    for parameter in 0..shapes[moved].parameters() {
        let mut at = |size: f64| {
            let mut step = [0.0; MAX_PARAMETERS];
            step[parameter] = size;
            shapes[moved] = features[moved].shape.stepped(&step);
            value(measurand, &shapes, &first)
        };
        gradient[parameter] = (at(DERIVATIVE_STEP)? - at(-DERIVATIVE_STEP)?) / (2.0 * DERIVATIVE_STEP);
    }
    Some(gradient)
}
