//! Camera estimate from the boards of a session so far: pose of each board, what is still missing.

use std::collections::BTreeSet;

use calibration::BoardGeometry;
use calibration::camera_fit::{CameraFit, fit_camera};
use calibration::observation::{CornerObservation, CornerView};
use nalgebra::{Vector2, Vector3};
use optics::{BoardFrame, PointMm};
use pipeline::board_geometry;
use remedy::with_remedy;

use crate::sessions::body::{BoardImage, CameraSoFar, SessionBody};
use crate::sessions::found::COVERAGE;

/// Fits the camera to all readable boards at rest and gives each its tilt, distance and residual.
pub fn learn_camera(body: &mut SessionBody) {
    let (width_px, height_px) = (body.width_px, body.height_px);
    let geometry = board_geometry(&body.target);
    let mut boards: Vec<&mut BoardImage> =
        body.poses.iter_mut().map(|pose| &mut pose.board).filter(|board| board.is_readable()).collect();
    let views: Vec<CornerView> =
        boards.iter().enumerate().map(|(block, board)| view_of(board, block, &geometry)).collect();
    let covered: BTreeSet<u32> = boards.iter().flat_map(|board| board.coverage_cells.iter().copied()).collect();
    let n_cells = (COVERAGE.0 * COVERAGE.1) as u32;
    body.camera.uncovered_cells = (0..n_cells).filter(|cell| !covered.contains(cell)).collect();
    let fit = fit_camera(width_px, height_px, views, Some(false));
    for (idx, board) in boards.iter_mut().enumerate() {
        describe(board, fit.as_ref().ok(), idx, &geometry);
    }
    body.camera = CameraSoFar {
        focal_px: fit.as_ref().ok().map(|fit| fit.station.camera.fx_px),
        rms_px: fit.as_ref().ok().map(|fit| fit.rms_px),
        uncovered_cells: std::mem::take(&mut body.camera.uncovered_cells),
        problem: fit.as_ref().err().map(|error| with_remedy(error)),
    };
}

fn view_of(board: &BoardImage, block: usize, geometry: &BoardGeometry) -> CornerView {
    let corners = board.corners.iter().map(|[column, row, u_px, v_px, sigma_px]| CornerObservation {
        board_mm: geometry.corner_mm(*column as usize, *row as usize),
        pixel: Vector2::new(*u_px, *v_px),
        sigma_px: *sigma_px,
    });
    CornerView { block, travel_mm: 0.0, corners: corners.collect() }
}

fn describe(board: &mut BoardImage, fit: Option<&CameraFit>, idx: usize, geometry: &BoardGeometry) {
    let Some(fit) = fit else {
        (board.tilt_deg, board.distance_mm, board.rms_px) = (None, None, None);
        return;
    };
    let pose = fit.station.poses[idx];
    let normal = pose.rotation * Vector3::z();
    board.tilt_deg = Some(normal.z.abs().min(1.0).acos().to_degrees());
    board.distance_mm = Some((pose * PointMm::<BoardFrame>::new(geometry.centre_mm())).xyz.z);
    let squares: f64 = fit.views[idx]
        .corners
        .iter()
        .filter_map(|corner| {
            let seen = fit.station.camera.project(&(pose * PointMm::<BoardFrame>::new(corner.board_mm)).xyz)?;
            Some((seen - corner.pixel).norm_squared())
        })
        .sum();
    board.rms_px = Some((squares / fit.views[idx].corners.len() as f64).sqrt());
}
