//! Uncertainty from the noise of the points.
//!
//! Points of one line share their noise over several columns, so their information is divided by
//! (correlation length) / (spacing). Residuals larger than predicted widen the uncertainty, smaller ones do not
//! narrow it (Birge's ratio, one-sided); if the cloud carries no σ, the residuals alone set it.

use scanning::Cloud;

use crate::features::Found;
use crate::fit::covariance;
use crate::params::{FLATNESS_SHARE, NOISE_CORRELATION_KEY, NOISE_CORRELATION_PX};
use crate::request::Tool;
use crate::robust::weighted;
use crate::sample::{Samples, median};
use crate::shape::{MAX_PARAMETERS, Shape};
use crate::value::{FirstPoints, value};

/// Step of the numerical derivatives of a value by a shape's parameters (mm or rad).
const DERIVATIVE_STEP: f64 = 1e-6;

/// Noise of the points of one feature.
pub(crate) struct FeatureNoise {
    /// Standard deviation along the ray of every inlier, mm.
    pub(crate) sigma_mm: Vec<f64>,
}

/// What the noise does to a value.
pub(crate) struct NoiseResult {
    pub(crate) standard_uncertainty: f64,
    /// Largest ratio of residuals to predicted noise over the features.
    pub(crate) ratio: f64,
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

/// How many points carry the information of one.
fn redundancy(cloud: &Cloud, samples: &Samples, inliers: &[u32], correlation_px: f64) -> f64 {
    let mut spacings: Vec<f64> = inliers
        .windows(2)
        .filter_map(|pair| {
            let [a, b] = [pair[0], pair[1]].map(|idx| &cloud.points[samples.at(idx).cloud_idx]);
            let same_line = a.frame == b.frame && a.order == b.order;
            let spacing_px = f64::from((a.u_px - b.u_px).abs().max((a.v_px - b.v_px).abs()));
            (same_line && spacing_px > 0.0).then_some(spacing_px)
        })
        .collect();
    let spacing_px = if spacings.is_empty() { 1.0 } else { median(&mut spacings) };
    (correlation_px / spacing_px).max(1.0)
}

/// Propagates the noise of the points to the value of a tool.
pub(crate) fn propagate(
    cloud: &Cloud,
    samples: &Samples,
    tool: Tool,
    features: &[Found],
    noises: &[FeatureNoise],
) -> Option<NoiseResult> {
    let correlation = correlation_px(cloud);
    let mut variance = 0.0;
    let mut ratio: f64 = 0.0;
    for (idx, (feature, noise)) in features.iter().zip(noises).enumerate() {
        let along_normal = normal_sigmas(samples, feature, noise);
        let birge = birge_ratio(samples, feature, &along_normal);
        ratio = ratio.max(birge);
        let scale = if samples.sigma_known { birge.max(1.0) } else { birge };
        let redundancy = redundancy(cloud, samples, &feature.inliers, correlation);
        let variances: Vec<f64> = along_normal.iter().map(|s| s * s * scale * scale * redundancy).collect();
        variance += if tool == Tool::Flatness {
            flatness_variance(samples, feature, redundancy)
        } else {
            let points = weighted(samples, &feature.inliers, &feature.shape);
            let gradient = value_gradient(samples, tool, features, idx)?;
            gradient.dot(&(covariance(&feature.shape, &points, &variances)? * gradient))
        };
    }
    Some(NoiseResult { standard_uncertainty: variance.max(0.0).sqrt(), ratio })
}

fn normal_sigmas(samples: &Samples, feature: &Found, noise: &FeatureNoise) -> Vec<f64> {
    feature
        .inliers
        .iter()
        .zip(&noise.sigma_mm)
        .map(|(&idx, sigma_mm)| sigma_mm * samples.at(idx).cosine(&feature.shape))
        .collect()
}

fn birge_ratio(samples: &Samples, feature: &Found, along_normal: &[f64]) -> f64 {
    let sum: f64 = feature
        .inliers
        .iter()
        .zip(along_normal)
        .map(|(&idx, sigma)| (feature.shape.distance_mm(&samples.at(idx).in_part.xyz) / sigma).powi(2))
        .sum();
    (sum / feature.inliers.len() as f64).sqrt()
}

fn value_gradient(samples: &Samples, tool: Tool, features: &[Found], moved: usize) -> Option<crate::fit::Vector> {
    let first = FirstPoints { positions: Vec::new(), camera: samples.mean_camera(&features[0].inliers) };
    let mut shapes: Vec<Shape> = features.iter().map(|f| f.shape).collect();
    let mut gradient = crate::fit::Vector::zeros();
    for parameter in 0..shapes[moved].parameters() {
        let mut at = |size: f64| {
            let mut step = [0.0; MAX_PARAMETERS];
            step[parameter] = size;
            shapes[moved] = features[moved].shape.stepped(&step);
            value(tool, &shapes, &first, false)
        };
        gradient[parameter] = (at(DERIVATIVE_STEP)? - at(-DERIVATIVE_STEP)?) / (2.0 * DERIVATIVE_STEP);
    }
    Some(gradient)
}

/// Variance of the distance between two tail quantiles, as for normal residuals: q(1 − q)/(n·density²) each.
fn flatness_variance(samples: &Samples, feature: &Found, redundancy: f64) -> f64 {
    /// Quantile 0.9995 of the standard normal distribution and its density there.
    const TAIL_DENSITY: f64 = 0.001_780;
    let tail = (1.0 - FLATNESS_SHARE) / 2.0;
    let n = feature.inliers.len() as f64;
    let square: f64 =
        feature.inliers.iter().map(|&idx| feature.shape.distance_mm(&samples.at(idx).in_part.xyz).powi(2)).sum();
    2.0 * (square / n) * redundancy * tail * (1.0 - tail) / (n * TAIL_DENSITY * TAIL_DENSITY)
}
