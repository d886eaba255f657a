//! Two crossing lines, from images to a cloud, compared with ground truth.
//!
//! The images are those of two simulated stations with the same camera, board, part and stage, whose light planes run along
//! rows and along columns. Not shown here: lines far from the directions of rows and columns.

use crate::common::{copy_of_small, edit_manifest, err, sheaf};
use crate::rigs::lasers::{capture_of, check_lines, switched_of};
use capture::{CrossProjector, Projector};
use nalgebra::Vector3;
use optics::Stage;
use scanning::files::read_cloud;
use serde_json::json;
use twin::{StationModel, StationShape};
use vision::LineDirection;

const DIRECTIONS: [LineDirection; 2] = [LineDirection::Rows, LineDirection::Columns];

/// A station whose light is one plane; the stage moves obliquely to both lines, so that each sweeps the part.
fn station(line_direction: LineDirection) -> StationModel {
    let shape =
        StationShape { width_px: 960, height_px: 768, orders: vec![0], line_direction, ..StationShape::default() };
    let mut model = StationModel::seeded(11, &shape).unwrap();
    if let Stage::Linear(axis) = &mut model.stage {
        axis.direction = Vector3::new(0.6, 0.8, 0.01);
    }
    model
}

#[test]
fn a_cross_is_calibrated_and_scans() {
    let folder = capture_of(&DIRECTIONS.map(station), Projector::Cross(CrossProjector::default()));
    // Every image gives two frames, one per line.
    check_lines(&folder, &DIRECTIONS, 2, &station(LineDirection::Rows));
    crate::commands::schemas::follows("capture", &folder.path().join("0/capture.json"));
    let points = read_cloud(folder.path().join("gauge.ply").as_path()).unwrap().points;
    assert!(points.iter().all(|point| u32::from(point.order == 1) == point.frame % 2), "frames of the other line");
}

#[test]
fn a_cross_whose_lines_are_lit_one_by_one_is_calibrated_and_scans() {
    let folder = switched_of(&DIRECTIONS.map(station), Projector::Cross(CrossProjector { switched: true }));
    check_lines(&folder, &DIRECTIONS, 2, &station(LineDirection::Rows));
    crate::commands::schemas::follows("capture", &folder.path().join("0/capture.json"));
}

#[test]
fn entries_that_contradict_a_cross_are_reported() {
    for (projector, words) in [
        (json!({ "kind": "cross", "line_direction": "rows" }), "projector.line_direction"),
        (json!({ "kind": "cross", "lines": 3 }), "projector.lines"),
        (json!({ "kind": "planes" }), "projector.lines is missing"),
        (json!({ "kind": "star" }), "`cross`"),
    ] {
        let folder = copy_of_small();
        edit_manifest(folder.path(), |manifest| manifest["projector"] = projector);
        let refused = sheaf(&["calibrate", folder.path().to_str().unwrap(), "-o", "x.json", "-q"]);
        let message = err(&refused);
        assert!(!refused.status.success() && message.contains(words), "`{words}` is not in:\n{message}");
    }
}
