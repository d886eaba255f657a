//! Point density, σ and depth range of a scan, from the calibration alone.

use nalgebra::{Vector2, Vector3};
use optics::{Calibration, Stage};
use scanning::depth_envelope;
use station::StationStatus;
use statistics::median;
use vision::LineDirection;

use super::params::{CLOUD_POINT_BYTES, DISPLAY_POINT_BYTES, EXPECTED_SIGMA_PX, PEAK_BYTES, PREDICTION_STEP_PX};

/// Prediction for a scan from its calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// See `ScanPlan`.
    pub rows_per_mm: f64,
    /// See `ScanPlan`.
    pub points_per_mm_along_line: f64,
    /// See `ScanPlan`.
    pub sigma_mm: Option<f64>,
    /// See `ScanPlan`.
    pub depth_mm: [f64; 2],
    /// See `ScanPlan`.
    pub unambiguous_depth_mm: [f64; 2],
}

/// Predicts for a flat part perpendicular to the camera axis in the middle of the calibrated depth range, with rows `step`
/// apart in the unit of the stage; on a turntable for a surface half-way between the axis and the nearest depth.
pub fn predict(calibration: &Calibration, step: f64) -> Prediction {
    let envelope = depth_envelope(calibration, calibration.depth_range_mm);
    let direction = line_direction(calibration);
    let range = calibration.depth_range_mm;
    let middle_mm = 0.5 * (range.near_mm + range.far_mm);
    let camera = &calibration.camera;
    let (focal_px, along) = match direction {
        LineDirection::Rows => (camera.fx_px, 0),
        LineDirection::Columns => (camera.fy_px, 1),
    };
    // Part motion perpendicular to the lines per mm of travel or per degree.
    let across = match calibration.stage {
        None => 1.0,
        Some(Stage::Linear(axis)) => axis.direction[1 - along].abs(),
        Some(Stage::Rotary(axis)) => 0.5 * (axis.point_mm.z - range.near_mm).max(0.0) * 1_f64.to_radians(),
    };
    Prediction {
        rows_per_mm: if step * across > 0.0 { 1.0 / (step * across) } else { 0.0 },
        points_per_mm_along_line: focal_px / middle_mm,
        sigma_mm: median_sigma_mm(calibration, direction),
        depth_mm: [envelope.stated_mm.near_mm, envelope.stated_mm.far_mm],
        unambiguous_depth_mm: [envelope.unambiguous_mm.near_mm, envelope.unambiguous_mm.far_mm],
    }
}

/// Direction of the lines: the image axis along which the sheets of neighbouring orders are not separated.
fn line_direction(calibration: &Calibration) -> LineDirection {
    let camera = &calibration.camera;
    let centre = Vector2::new(camera.width_px as f64 / 2.0, camera.height_px as f64 / 2.0);
    let normal = calibration.orders.iter().find_map(|&order| {
        calibration.triangulate(order, &centre, None).map(|point| -> Vector3<f64> { point.hit.normal })
    });
    match normal {
        Some(normal) if normal.x.abs() > normal.y.abs() => LineDirection::Columns,
        _ => LineDirection::Rows,
    }
}

/// Median σ along the ray over the calibrated volume, from image noise and the covariance of the calibration.
fn median_sigma_mm(calibration: &Calibration, direction: LineDirection) -> Option<f64> {
    let camera = &calibration.camera;
    let normal = match direction {
        LineDirection::Rows => [0.0, 1.0],
        LineDirection::Columns => [1.0, 0.0],
    };
    let nodes = |size_px: usize| (0..size_px).step_by(PREDICTION_STEP_PX).map(|px| px as f64);
    let mut sigmas_mm = Vec::new();
    for (u_px, v_px) in nodes(camera.width_px).flat_map(|u| nodes(camera.height_px).map(move |v| (u, v))) {
        for &order in &calibration.orders {
            let Some(point) = calibration.triangulate(order, &Vector2::new(u_px, v_px), None) else { continue };
            if !calibration.depth_range_mm.contains(point.hit.depth_mm) {
                continue;
            }
            let noise_mm = point.noise_sigma_mm(&normal, EXPECTED_SIGMA_PX);
            let systematic_mm = calibration.systematic_sigma_mm(order, &point).unwrap_or(0.0);
            sigmas_mm.push(noise_mm.hypot(systematic_mm));
        }
    }
    median(&mut sigmas_mm)
}

/// Disk space of a scan, bytes: peaks twice (work file and stored), cloud, display points, and the kept images twice.
pub fn disk_bytes(max_points: u64, n_kept: usize, status: &StationStatus) -> u64 {
    let roi = status.camera_settings.roi;
    let bytes_per_px = match status.camera_settings.pixel_format {
        devices::PixelFormat::Mono8 => 1,
        devices::PixelFormat::Mono16 => 2,
    };
    let image_bytes = (roi.width_px * roi.height_px * bytes_per_px) as u64;
    let images_bytes = 2 * n_kept as u64 * image_bytes;
    max_points * (2 * PEAK_BYTES + CLOUD_POINT_BYTES + DISPLAY_POINT_BYTES) + images_bytes
}
