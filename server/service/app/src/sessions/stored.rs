//! The content of a calibration session as stored in its record.
//!
//! The stored types list every field of their domain type; `remote` makes the compiler check this.

use capture::{Projector, Target};
use optics::StagePosition;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use crate::camera::correction::ImageDarkFrame;
use crate::sessions::body::{
    BoardImage, CameraSoFar, LaserImage, SessionBody, SessionImage, SessionPose, SessionStageView,
};
use crate::sessions::image_capture::Exposures;

/// From the form that is stored.
///
/// # Errors
/// If it is another form.
pub fn from_stored(stored: Value) -> Result<SessionBody, serde_json::Error> {
    StoredSessionBody::deserialize(stored)
}

/// The form that is stored.
pub fn to_stored(body: &SessionBody) -> Value {
    StoredSessionBody::serialize(body, serde_json::value::Serializer).expect("a session is numbers and texts")
}

/// The stored form of [`SessionBody`]; the types below are those of its parts.
#[derive(Serialize, Deserialize)]
#[serde(remote = "SessionBody")]
struct StoredSessionBody {
    name: String,
    #[serde(deserialize_with = "read_target")]
    target: Target,
    projector: Projector,
    #[serde(with = "StoredExposures")]
    exposures: Exposures,
    width_px: usize,
    height_px: usize,
    #[serde(serialize_with = "write_poses", deserialize_with = "read_poses")]
    poses: Vec<SessionPose>,
    #[serde(serialize_with = "write_views", deserialize_with = "read_views")]
    stage_views: Vec<SessionStageView>,
    #[serde(with = "StoredCameraSoFar")]
    camera: CameraSoFar,
    job_id: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Exposures")]
struct StoredExposures {
    board_exposure_us: f64,
    laser_exposure_us: f64,
    laser_power: f64,
    #[serde(default)]
    background_above_levels: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "SessionImage")]
struct StoredSessionImage {
    artifact: String,
    exposure_us: f64,
    taken_at_ms: i64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dark_frame: Option<ImageDarkFrame>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "BoardImage")]
struct StoredBoardImage {
    #[serde(alias = "picture", with = "StoredSessionImage")]
    image: SessionImage,
    corners: Vec<[f64; 5]>,
    coverage_cells: Vec<u32>,
    corner_sigma_px: Option<f64>,
    #[serde(alias = "saturated_share")]
    saturated_fraction: f64,
    tilt_deg: Option<f64>,
    distance_mm: Option<f64>,
    rms_px: Option<f64>,
    problem: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "LaserImage")]
struct StoredLaserImage {
    #[serde(alias = "picture", with = "StoredSessionImage")]
    image: SessionImage,
    #[serde(default, serialize_with = "write_image", deserialize_with = "read_image")]
    background: Option<SessionImage>,
    n_segments: usize,
    n_points: usize,
    lines_px: Vec<Vec<[f64; 2]>>,
    #[serde(alias = "saturated_share")]
    saturated_fraction: f64,
    problem: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "SessionPose")]
struct StoredSessionPose {
    id: String,
    #[serde(with = "StoredBoardImage")]
    board: BoardImage,
    #[serde(default, serialize_with = "write_laser", deserialize_with = "read_laser")]
    laser: Option<LaserImage>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "SessionStageView")]
struct StoredSessionStageView {
    id: String,
    #[serde(flatten, with = "StoredPosition")]
    position: StagePosition,
    #[serde(with = "StoredBoardImage")]
    board: BoardImage,
}

/// One of two keys.
#[derive(Serialize, Deserialize)]
#[serde(remote = "StagePosition")]
enum StoredPosition {
    #[serde(rename = "position_mm")]
    LinearMm(f64),
    #[serde(rename = "angle_deg")]
    RotaryDeg(f64),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "CameraSoFar")]
struct StoredCameraSoFar {
    focal_px: Option<f64>,
    rms_px: Option<f64>,
    uncovered_cells: Vec<u32>,
    problem: Option<String>,
}

/// A target is stored as in a manifest; without a kind it is a chessboard.
fn read_target<'de, D: Deserializer<'de>>(from: D) -> Result<Target, D::Error> {
    let mut stored = serde_json::Map::deserialize(from)?;
    stored.entry("kind").or_insert_with(|| "chessboard".into());
    Target::deserialize(Value::Object(stored)).map_err(D::Error::custom)
}

// Items of lists and options are wrapped to use their stored form.

#[derive(Serialize)]
struct WrittenPose<'a>(#[serde(with = "StoredSessionPose")] &'a SessionPose);

#[derive(Deserialize)]
struct ReadPose(#[serde(with = "StoredSessionPose")] SessionPose);

fn write_poses<S: Serializer>(poses: &[SessionPose], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(poses.iter().map(WrittenPose))
}

fn read_poses<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<SessionPose>, D::Error> {
    Ok(Vec::<ReadPose>::deserialize(from)?.into_iter().map(|read| read.0).collect())
}

#[derive(Serialize)]
struct WrittenView<'a>(#[serde(with = "StoredSessionStageView")] &'a SessionStageView);

#[derive(Deserialize)]
struct ReadView(#[serde(with = "StoredSessionStageView")] SessionStageView);

fn write_views<S: Serializer>(views: &[SessionStageView], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(views.iter().map(WrittenView))
}

fn read_views<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<SessionStageView>, D::Error> {
    Ok(Vec::<ReadView>::deserialize(from)?.into_iter().map(|read| read.0).collect())
}

#[derive(Serialize)]
struct WrittenImage<'a>(#[serde(with = "StoredSessionImage")] &'a SessionImage);

#[derive(Deserialize)]
struct ReadImage(#[serde(with = "StoredSessionImage")] SessionImage);

fn write_image<S: Serializer>(image: &Option<SessionImage>, to: S) -> Result<S::Ok, S::Error> {
    image.as_ref().map(WrittenImage).serialize(to)
}

fn read_image<'de, D: Deserializer<'de>>(from: D) -> Result<Option<SessionImage>, D::Error> {
    Ok(Option::<ReadImage>::deserialize(from)?.map(|read| read.0))
}

#[derive(Serialize)]
struct WrittenLaser<'a>(#[serde(with = "StoredLaserImage")] &'a LaserImage);

#[derive(Deserialize)]
struct ReadLaser(#[serde(with = "StoredLaserImage")] LaserImage);

fn write_laser<S: Serializer>(laser: &Option<LaserImage>, to: S) -> Result<S::Ok, S::Error> {
    laser.as_ref().map(WrittenLaser).serialize(to)
}

fn read_laser<'de, D: Deserializer<'de>>(from: D) -> Result<Option<LaserImage>, D::Error> {
    Ok(Option::<ReadLaser>::deserialize(from)?.map(|read| read.0))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_stored_form_of_version_0_1_is_read_and_written_with_the_kinds_of_board_and_projector() {
        let image = json!({ "artifact": "ab", "exposure_us": 800.5, "taken_at_ms": 1_700_000_000_000_i64 });
        let board = json!({ "image": image, "corners": [[0.0, 1.0, 10.5, 20.25, 0.01]], "coverage_cells": [7],
            "corner_sigma_px": 0.02, "saturated_fraction": 0.1, "tilt_deg": 12.5, "distance_mm": 400.0, "rms_px": 0.03,
            "problem": null });
        let laser = json!({ "image": image, "n_segments": 5, "n_points": 9, "lines_px": [[[1.0, 2.0]]],
            "saturated_fraction": 0.0, "problem": "too dark" });
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
        assert_eq!((body.poses[0].board.corners[0][3], body.stage_views[0].position.mm()), (20.25, Some(-5.0)));
        assert_eq!(body.poses[0].laser.as_ref().unwrap().problem.as_deref(), Some("too dark"));
        let older = stored
            .to_string()
            .replace("\"image\"", "\"picture\"")
            .replace("saturated_fraction", "saturated_share");
        assert_eq!(
            from_stored(serde_json::from_str(&older).unwrap()).unwrap(),
            body,
            "the names of earlier builds"
        );
        let mut turned = stored.clone();
        turned["stage_views"][0] = json!({ "id": "v", "angle_deg": 15.0, "board": board });
        assert_eq!(from_stored(turned).unwrap().stage_views[0].position.deg(), Some(15.0));
        let mut now = stored;
        now["target"]["kind"] = json!("chessboard");
        now["projector"]["kind"] = json!("grating");
        now["exposures"]["background_above_levels"] = json!(null);
        now["poses"][0]["laser"]["background"] = json!(null);
        assert_eq!(to_stored(&body), now);
        now["poses"][0]["laser"]["background"] = image;
        now["exposures"]["background_above_levels"] = json!(20.0);
        assert_eq!(to_stored(&from_stored(now.clone()).unwrap()), now);
        assert!(from_stored(json!({ "name": "monday" })).is_err());
    }
}
