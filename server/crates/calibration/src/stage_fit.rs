//! The stage from a board it carries: direction per millimetre of travel, scale, straightness.

use nalgebra::{Matrix3, Vector3};
use optics::rotation::completing_frame;

use crate::report::StageReport;
use crate::station::BoardPose;

/// A straight line through freely fitted board positions: x_i = x_0 + s_i·t.
#[derive(Debug, Clone, PartialEq)]
pub struct StageLine {
    /// Board position at stage position 0.
    pub origin_mm: Vector3<f64>,
    /// Travel per mm.
    pub direction: Vector3<f64>,
    /// Covariance of `direction` from the scatter about the line.
    pub covariance: Matrix3<f64>,
    /// Position, deviation along, and two across, µm.
    pub straightness_um: Vec<[f64; 4]>,
}

/// Fits the line to the centres of the boards at the given stage positions; `None` with fewer than two distinct
/// positions.
pub fn stage_line(poses: &[BoardPose], positions_mm: &[f64], board_centre_mm: &Vector3<f64>) -> Option<StageLine> {
    let n = poses.len() as f64;
    let places: Vec<Vector3<f64>> =
        poses.iter().map(|p| p.rotation * board_centre_mm + p.translation_mm).collect();
    let mean_s = positions_mm.iter().sum::<f64>() / n;
    let mean_x = places.iter().sum::<Vector3<f64>>() / n;
    let spread: f64 = positions_mm.iter().map(|s| (s - mean_s).powi(2)).sum();
    if spread <= 0.0 {
        return None;
    }
    let direction: Vector3<f64> =
        places.iter().zip(positions_mm).map(|(x, s)| (x - mean_x) * (s - mean_s)).sum::<Vector3<f64>>() / spread;
    let origin_mm = mean_x - direction * mean_s;
    let deviations: Vec<Vector3<f64>> =
        places.iter().zip(positions_mm).map(|(x, s)| x - origin_mm - direction * *s).collect();
    let degrees = (n - 2.0).max(1.0);
    let scatter: Matrix3<f64> = deviations.iter().map(|d| d * d.transpose()).sum::<Matrix3<f64>>() / degrees;
    let along = direction.normalize();
    let (across_1, across_2) = completing_frame(&along);
    let straightness_um = deviations
        .iter()
        .zip(positions_mm)
        .map(|(d, s)| [*s, 1e3 * d.dot(&along), 1e3 * d.dot(&across_1), 1e3 * d.dot(&across_2)])
        .collect();
    Some(StageLine { origin_mm, direction, covariance: scatter / spread, straightness_um })
}

/// The report of a stage with direction and covariance from the joint fit.
pub fn stage_report(line: &StageLine, direction: &Vector3<f64>, covariance: &Matrix3<f64>) -> StageReport {
    let length = direction.norm();
    let unit = direction / length;
    let across: f64 = line.straightness_um.iter().map(|d| d[2] * d[2] + d[3] * d[3]).sum();
    StageReport {
        direction: (*direction).into(),
        sigma: std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt()),
        scale_error: length - 1.0,
        scale_sigma: (unit.transpose() * covariance * unit)[(0, 0)].max(0.0).sqrt(),
        straightness_um: line.straightness_um.clone(),
        straightness_rms_um: (across / line.straightness_um.len().max(1) as f64).sqrt(),
    }
}
