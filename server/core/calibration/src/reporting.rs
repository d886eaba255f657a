//! Assembles the report of a finished fit.

use nalgebra::{DMatrix, Matrix3, Vector2};
use optics::{CAMERA_PARAMETERS, Calibration, LightSurfaces};

use crate::findings::report::{
    AxisReport, CameraReport, LaserPoint, LightReport, OrderResidual, PoseResidual, StageReport,
};
use crate::first::camera_fit::{CameraFit, residuals};
use crate::fits::axis_fit::AxisFit;
use crate::fits::joint::JointFit;
use crate::fits::laser_points::LaserPoints;
use crate::fits::stage_fit::stage_report;
use crate::input::CalibrationInput;
use crate::params::{MAX_REPORT_POINTS, WAVELENGTH_OVER_PERIOD_RELATIVE_SIGMA};
use crate::solving::bundle::sheet_residual;
use crate::solving::bundle_state::BundleState;
use crate::solving::observation::CornerView;

/// Pixels per side of the grid on which the predicted σ is averaged.
const SIGMA_GRID: usize = 9;

/// The camera's section: residuals of `station` on `views`.
pub fn camera_report(
    input: &CalibrationInput,
    fit: &CameraFit,
    station: &BundleState,
    views: &[CornerView],
    covariance: &DMatrix<f64>,
) -> CameraReport {
    let names: Vec<&str> = input
        .poses
        .iter()
        .map(|pose| pose.name.as_str())
        .chain(input.stage_views.iter().map(|view| view.name.as_str()))
        .collect();
    let mut poses: Vec<PoseResidual> = names
        .iter()
        .map(|name| PoseResidual { name: (*name).to_owned(), rms_px: 0.0, n_corners: 0, residuals_px: Vec::new() })
        .collect();
    let mut squares = 0.0;
    for ((view_idx, _, error), corner) in
        residuals(station, views).zip(views.iter().flat_map(|view| &view.corners))
    {
        let pose = &mut poses[view_idx];
        pose.rms_px += error.norm_squared();
        pose.n_corners += 1;
        pose.residuals_px.push([corner.pixel.x, corner.pixel.y, -error.x, -error.y]);
        squares += error.norm_squared();
    }
    let n_corners: usize = poses.iter().map(|pose| pose.n_corners).sum();
    for pose in &mut poses {
        pose.rms_px = (pose.rms_px / pose.n_corners.max(1) as f64).sqrt();
    }
    CameraReport {
        rms_px: (squares / n_corners.max(1) as f64).sqrt(),
        poses,
        sigma: std::array::from_fn(|i| covariance[(i, i)].max(0.0).sqrt()),
        k3_reason: fit.k3_reason.clone(),
        corner_sigma_px: fit.corner_sigma_px,
        termination: fit.termination,
    }
}

/// The light's section.
pub fn light_report(
    input: &CalibrationInput,
    calibration: &Calibration,
    joint: &JointFit,
    points: &LaserPoints,
) -> LightReport {
    let light = &calibration.light;
    let mut lines: Vec<OrderResidual> = Vec::new();
    let mut kept: Vec<LaserPoint> = Vec::new();
    let thinning = points.observations.len().div_ceil(MAX_REPORT_POINTS).max(1);
    let (mut squares, mut n) = (0.0, 0usize);
    for (idx, point) in points.observations.iter().enumerate() {
        let pose = &joint.station.poses[point.block];
        let Some(sheet) = sheet_residual(&calibration.camera, light, pose, point, None) else { continue };
        let residual_px = sheet.residual_px;
        squares += residual_px * residual_px;
        n += 1;
        let name = &input.poses[point.block].name;
        let line = match lines.iter_mut().find(|line| line.pose == *name && line.order == point.order) {
            Some(line) => line,
            None => {
                lines.push(new_line(name, point.block, point.order, points));
                let last = lines.len() - 1;
                &mut lines[last]
            }
        };
        line.n_points += 1;
        line.mean_px += residual_px;
        line.rms_px += residual_px * residual_px;
        line.normalised_rms += (residual_px / point.sigma_px).powi(2);
        if idx % thinning == 0 {
            let (u_px, v_px) = (point.pixel.x, point.pixel.y);
            kept.push(LaserPoint { pose_idx: point.block, order: point.order, u_px, v_px, residual_px });
        }
    }
    for line in &mut lines {
        let count = line.n_points as f64;
        line.mean_px /= count;
        line.rms_px = (line.rms_px / count).sqrt();
        line.normalised_rms = (line.normalised_rms / count).sqrt();
    }
    LightReport {
        model: light.kind(),
        rms_px: (squares / n.max(1) as f64).sqrt(),
        residuals: lines,
        rejections: points.rejections,
        points: kept,
        wavelength_over_period: wavelength_estimate(input, calibration),
        systematic_sigma_mm: systematic_sigma(calibration),
        termination: joint.termination,
    }
}

fn new_line(pose: &str, block: usize, order: i8, points: &LaserPoints) -> OrderResidual {
    let n_outliers = points.outliers.iter().filter(|outlier| **outlier == (block, order)).count();
    OrderResidual {
        pose: pose.to_owned(),
        order,
        n_points: 0,
        mean_px: 0.0,
        rms_px: 0.0,
        normalised_rms: 0.0,
        n_outliers,
    }
}

/// Estimated λ/d_g, its σ, the nominal value.
fn wavelength_estimate(input: &CalibrationInput, calibration: &Calibration) -> Option<[f64; 3]> {
    let (value, idx) = match &calibration.light {
        LightSurfaces::Planes(_) => return None,
        LightSurfaces::Pencil(pencil) => (pencil.wavelength_over_period, CAMERA_PARAMETERS + 5),
        LightSurfaces::Grating(grating) => (grating.wavelength_over_period, CAMERA_PARAMETERS + 9),
    };
    let sheet = input.projector.grating?.wavelength_over_period();
    let sigma = calibration.covariance[(idx, idx)].sqrt().min(sheet * WAVELENGTH_OVER_PERIOD_RELATIVE_SIGMA);
    Some([value, sigma, sheet])
}

/// RMS over orders and image of the depth σ from the covariance, where the sheets are inside the calibrated depths.
fn systematic_sigma(calibration: &Calibration) -> f64 {
    let (width, height) = (calibration.camera.width_px as f64, calibration.camera.height_px as f64);
    let (mut squares, mut n) = (0.0, 0usize);
    for &order in &calibration.orders {
        for row in 0..SIGMA_GRID {
            for column in 0..SIGMA_GRID {
                let place = |idx: usize, side: f64| (idx as f64 + 0.5) / SIGMA_GRID as f64 * side;
                let pixel = Vector2::new(place(column, width), place(row, height));
                let Some(point) = calibration.triangulate(order, &pixel, None) else { continue };
                if !calibration.depth_range_mm.contains(point.hit.depth_mm) {
                    continue;
                }
                if let Some(sigma) = calibration.systematic_sigma_mm(order, &point) {
                    squares += (sigma / point.ray.norm()).powi(2);
                    n += 1;
                }
            }
        }
    }
    (squares / n.max(1) as f64).sqrt()
}

/// The section of a turntable's axis, whose covariance is the last of `covariance`.
pub fn axis_section(turn: &AxisFit, covariance: &DMatrix<f64>) -> AxisReport {
    let start = covariance.nrows() - 4;
    turn.report(&covariance.fixed_view::<4, 4>(start, start).into_owned())
}

/// The stage's section.
pub fn stage_section(joint: &JointFit) -> Option<StageReport> {
    let direction = joint.station.stage?;
    let line = joint.stage_line.as_ref()?;
    let start = joint.covariance.nrows() - 3;
    let covariance: Matrix3<f64> = joint.covariance.fixed_view::<3, 3>(start, start).into_owned();
    Some(stage_report(line, &direction, &covariance))
}
