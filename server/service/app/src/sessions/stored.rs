//! What a calibration session has gathered, as its record keeps it.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::sessions::body::{
    BoardPicture, CameraSoFar, LaserPicture, Picture, ProjectorSheet, SessionBody, SessionPose, SessionStageView,
    Target,
};
use crate::sessions::photographer::Exposures;

/// From the form that is stored.
///
/// # Errors
/// If it is another form.
pub fn from_stored(stored: Value) -> Result<SessionBody, serde_json::Error> {
    Ok(serde_json::from_value::<StoredSessionBody>(stored)?.into())
}

/// The form that is stored.
pub fn to_stored(body: &SessionBody) -> Value {
    serde_json::to_value(StoredSessionBody::from(body.clone())).expect("a session is numbers and texts")
}

/// The stored form of [`SessionBody`]; those below are of its parts, field by field.
#[derive(Serialize, Deserialize)]
struct StoredSessionBody {
    name: String,
    target: StoredTarget,
    projector: StoredProjectorSheet,
    exposures: StoredExposures,
    width_px: usize,
    height_px: usize,
    poses: Vec<StoredSessionPose>,
    stage_views: Vec<StoredSessionStageView>,
    camera: StoredCameraSoFar,
    job_id: Option<String>,
}

#[derive(Serialize, Deserialize)]
struct StoredTarget {
    inner_columns: usize,
    inner_rows: usize,
    square_mm: f64,
}

#[derive(Serialize, Deserialize)]
struct StoredProjectorSheet {
    wavelength_nm: f64,
    grating_lines_per_mm: f64,
    orders: Vec<i8>,
    line_direction: String,
}

#[derive(Serialize, Deserialize)]
struct StoredExposures {
    board_exposure_us: f64,
    laser_exposure_us: f64,
    laser_power: f64,
}

#[derive(Serialize, Deserialize)]
struct StoredPicture {
    artifact: String,
    exposure_us: f64,
    taken_at_ms: i64,
}

#[derive(Serialize, Deserialize)]
struct StoredBoardPicture {
    picture: StoredPicture,
    corners: Vec<[f64; 5]>,
    coverage_cells: Vec<u32>,
    corner_sigma_px: Option<f64>,
    saturated_share: f64,
    tilt_deg: Option<f64>,
    distance_mm: Option<f64>,
    rms_px: Option<f64>,
    problem: Option<String>,
}

#[derive(Serialize, Deserialize)]
struct StoredLaserPicture {
    picture: StoredPicture,
    n_segments: usize,
    n_points: usize,
    lines_px: Vec<Vec<[f64; 2]>>,
    saturated_share: f64,
    problem: Option<String>,
}

#[derive(Serialize, Deserialize)]
struct StoredSessionPose {
    id: String,
    board: StoredBoardPicture,
    laser: Option<StoredLaserPicture>,
}

#[derive(Serialize, Deserialize)]
struct StoredSessionStageView {
    id: String,
    position_mm: f64,
    board: StoredBoardPicture,
}

#[derive(Serialize, Deserialize)]
struct StoredCameraSoFar {
    focal_px: Option<f64>,
    rms_px: Option<f64>,
    uncovered_cells: Vec<u32>,
    problem: Option<String>,
}

impl From<SessionBody> for StoredSessionBody {
    fn from(of: SessionBody) -> Self {
        let SessionBody {
            name,
            target,
            projector,
            exposures,
            width_px,
            height_px,
            poses,
            stage_views,
            camera,
            job_id,
        } = of;
        Self {
            name,
            target: target.into(),
            projector: projector.into(),
            exposures: exposures.into(),
            width_px,
            height_px,
            poses: poses.into_iter().map(Into::into).collect(),
            stage_views: stage_views.into_iter().map(Into::into).collect(),
            camera: camera.into(),
            job_id,
        }
    }
}

impl From<StoredSessionBody> for SessionBody {
    fn from(of: StoredSessionBody) -> Self {
        let StoredSessionBody {
            name,
            target,
            projector,
            exposures,
            width_px,
            height_px,
            poses,
            stage_views,
            camera,
            job_id,
        } = of;
        Self {
            name,
            target: target.into(),
            projector: projector.into(),
            exposures: exposures.into(),
            width_px,
            height_px,
            poses: poses.into_iter().map(Into::into).collect(),
            stage_views: stage_views.into_iter().map(Into::into).collect(),
            camera: camera.into(),
            job_id,
        }
    }
}

impl From<Target> for StoredTarget {
    fn from(of: Target) -> Self {
        let Target { inner_columns, inner_rows, square_mm } = of;
        Self { inner_columns, inner_rows, square_mm }
    }
}

impl From<StoredTarget> for Target {
    fn from(of: StoredTarget) -> Self {
        let StoredTarget { inner_columns, inner_rows, square_mm } = of;
        Self { inner_columns, inner_rows, square_mm }
    }
}

impl From<ProjectorSheet> for StoredProjectorSheet {
    fn from(of: ProjectorSheet) -> Self {
        let ProjectorSheet { wavelength_nm, grating_lines_per_mm, orders, line_direction } = of;
        Self { wavelength_nm, grating_lines_per_mm, orders, line_direction }
    }
}

impl From<StoredProjectorSheet> for ProjectorSheet {
    fn from(of: StoredProjectorSheet) -> Self {
        let StoredProjectorSheet { wavelength_nm, grating_lines_per_mm, orders, line_direction } = of;
        Self { wavelength_nm, grating_lines_per_mm, orders, line_direction }
    }
}

impl From<Exposures> for StoredExposures {
    fn from(of: Exposures) -> Self {
        let Exposures { board_exposure_us, laser_exposure_us, laser_power } = of;
        Self { board_exposure_us, laser_exposure_us, laser_power }
    }
}

impl From<StoredExposures> for Exposures {
    fn from(of: StoredExposures) -> Self {
        let StoredExposures { board_exposure_us, laser_exposure_us, laser_power } = of;
        Self { board_exposure_us, laser_exposure_us, laser_power }
    }
}

impl From<Picture> for StoredPicture {
    fn from(of: Picture) -> Self {
        let Picture { artifact, exposure_us, taken_at_ms } = of;
        Self { artifact, exposure_us, taken_at_ms }
    }
}

impl From<StoredPicture> for Picture {
    fn from(of: StoredPicture) -> Self {
        let StoredPicture { artifact, exposure_us, taken_at_ms } = of;
        Self { artifact, exposure_us, taken_at_ms }
    }
}

impl From<BoardPicture> for StoredBoardPicture {
    fn from(of: BoardPicture) -> Self {
        let BoardPicture {
            picture,
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        } = of;
        Self {
            picture: picture.into(),
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        }
    }
}

impl From<StoredBoardPicture> for BoardPicture {
    fn from(of: StoredBoardPicture) -> Self {
        let StoredBoardPicture {
            picture,
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        } = of;
        Self {
            picture: picture.into(),
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        }
    }
}

impl From<LaserPicture> for StoredLaserPicture {
    fn from(of: LaserPicture) -> Self {
        let LaserPicture { picture, n_segments, n_points, lines_px, saturated_share, problem } = of;
        Self { picture: picture.into(), n_segments, n_points, lines_px, saturated_share, problem }
    }
}

impl From<StoredLaserPicture> for LaserPicture {
    fn from(of: StoredLaserPicture) -> Self {
        let StoredLaserPicture { picture, n_segments, n_points, lines_px, saturated_share, problem } = of;
        Self { picture: picture.into(), n_segments, n_points, lines_px, saturated_share, problem }
    }
}

impl From<SessionPose> for StoredSessionPose {
    fn from(of: SessionPose) -> Self {
        let SessionPose { id, board, laser } = of;
        Self { id, board: board.into(), laser: laser.map(Into::into) }
    }
}

impl From<StoredSessionPose> for SessionPose {
    fn from(of: StoredSessionPose) -> Self {
        let StoredSessionPose { id, board, laser } = of;
        Self { id, board: board.into(), laser: laser.map(Into::into) }
    }
}

impl From<SessionStageView> for StoredSessionStageView {
    fn from(of: SessionStageView) -> Self {
        let SessionStageView { id, position_mm, board } = of;
        Self { id, position_mm, board: board.into() }
    }
}

impl From<StoredSessionStageView> for SessionStageView {
    fn from(of: StoredSessionStageView) -> Self {
        let StoredSessionStageView { id, position_mm, board } = of;
        Self { id, position_mm, board: board.into() }
    }
}

impl From<CameraSoFar> for StoredCameraSoFar {
    fn from(of: CameraSoFar) -> Self {
        let CameraSoFar { focal_px, rms_px, uncovered_cells, problem } = of;
        Self { focal_px, rms_px, uncovered_cells, problem }
    }
}

impl From<StoredCameraSoFar> for CameraSoFar {
    fn from(of: StoredCameraSoFar) -> Self {
        let StoredCameraSoFar { focal_px, rms_px, uncovered_cells, problem } = of;
        Self { focal_px, rms_px, uncovered_cells, problem }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_version_0_1_stored_is_read_and_stored_alike() {
        let picture = json!({ "artifact": "ab", "exposure_us": 800.5, "taken_at_ms": 1_700_000_000_000_i64 });
        let board = json!({ "picture": picture, "corners": [[0.0, 1.0, 10.5, 20.25, 0.01]], "coverage_cells": [7],
            "corner_sigma_px": 0.02, "saturated_share": 0.1, "tilt_deg": 12.5, "distance_mm": 400.0, "rms_px": 0.03,
            "problem": null });
        let laser = json!({ "picture": picture, "n_segments": 5, "n_points": 9, "lines_px": [[[1.0, 2.0]]],
            "saturated_share": 0.0, "problem": "too dark" });
        let stored = json!({
            "name": "monday", "target": { "inner_columns": 11, "inner_rows": 8, "square_mm": 10.0 },
            "projector": { "wavelength_nm": 650.0, "grating_lines_per_mm": 300.0, "orders": [-1, 0, 1],
                "line_direction": "columns" },
            "exposures": { "board_exposure_us": 4000.0, "laser_exposure_us": 900.0, "laser_power": 0.5 },
            "width_px": 1280, "height_px": 1024, "poses": [{ "id": "p", "board": board, "laser": laser }],
            "stage_views": [{ "id": "v", "position_mm": -5.0, "board": board }],
            "camera": { "focal_px": 2000.0, "rms_px": 0.04, "uncovered_cells": [1, 2], "problem": null },
            "job_id": "j",
        });
        let body = from_stored(stored.clone()).unwrap();
        assert_eq!((body.poses[0].board.corners[0][3], body.stage_views[0].position_mm), (20.25, -5.0));
        assert_eq!(body.poses[0].laser.as_ref().unwrap().problem.as_deref(), Some("too dark"));
        assert_eq!(to_stored(&body), stored);
        assert!(from_stored(json!({ "name": "monday" })).is_err());
    }
}
