//! The published JSON Schema and the reader agree on valid manifests.
//!
//! Not covered: rules that a schema cannot state (monotonic orders, unique names, files); see `bad_input.rs`.

use crate::common::{folder_with, manifest_with, refusal, valid_manifest};
use capture::Capture;
use serde_json::{Value, json};

fn schema() -> jsonschema::Validator {
    let text = include_str!("../../../../docs/schemas/capture.schema.json");
    jsonschema::validator_for(&serde_json::from_str(text).unwrap()).unwrap()
}

#[test]
fn a_valid_manifest_fits_the_schema() {
    assert!(schema().is_valid(&valid_manifest()));
}

#[test]
fn a_charuco_board_fits_the_schema() {
    let board = json!({"kind": "charuco", "columns": 10, "rows": 7, "square_mm": [20, 20.1], "marker_mm": 14,
        "dictionary": "DICT_5X5_100"});
    let manifest = manifest_with("/target", board);
    assert!(schema().is_valid(&manifest));
    let capture = Capture::open(folder_with(&manifest).path()).unwrap();
    assert!(schema().is_valid(&serde_json::to_value(&capture.manifest).unwrap()));
}

#[test]
fn circle_grids_fit_the_schema() {
    for kind in ["circles", "asymmetric_circles"] {
        let grid = json!({"kind": kind, "columns": 4, "rows": 11, "square_mm": 15, "diameter_mm": 12});
        let manifest = manifest_with("/target", grid);
        assert!(schema().is_valid(&manifest));
        let capture = Capture::open(folder_with(&manifest).path()).unwrap();
        assert!(schema().is_valid(&serde_json::to_value(&capture.manifest).unwrap()));
    }
}

#[test]
fn independent_lasers_fit_the_schema() {
    let manifest = manifest_with("/projector", json!({"kind": "planes", "lines": 2}));
    assert!(schema().is_valid(&manifest));
    let capture = Capture::open(folder_with(&manifest).path()).unwrap();
    assert!(schema().is_valid(&serde_json::to_value(&capture.manifest).unwrap()));
}

#[test]
fn a_written_manifest_fits_the_schema() {
    let capture = Capture::open(folder_with(&valid_manifest()).path()).unwrap();
    assert!(schema().is_valid(&serde_json::to_value(&capture.manifest).unwrap()));
}

#[test]
fn schema_and_reader_refuse_the_same_manifests() {
    let schema = schema();
    let broken: [(&str, Value); 29] = [
        ("/format", json!("sheaf-capture/2")),
        ("/camera/width_px", json!(0)),
        ("/camera/width_px", json!(12.5)),
        ("/camera", json!({"width_px": 16, "height_px": 12, "channel": "infrared"})),
        ("/camera", json!({"width_px": 16, "height_px": 12, "white_level": 0})),
        ("/camera", json!({"width_px": 16, "height_px": 12, "white_level": 70_000})),
        ("/target/kind", json!("hexagons")),
        ("/target", json!({"kind": "circles", "columns": 9, "rows": 7, "square_mm": 20})),
        ("/target/inner_rows", json!(1)),
        ("/target/square_mm", json!([12])),
        ("/target", json!({"kind": "charuco", "columns": 10, "rows": 7, "square_mm": 20, "marker_mm": 14})),
        ("/target/square_mm", json!(0)),
        ("/projector", json!({"wavelength_nm": 660, "orders": [0]})),
        ("/projector", json!({"kind": "planes", "orders": [0]})),
        ("/projector", json!({"kind": "planes", "lines": 42})),
        ("/projector/orders", json!([])),
        ("/projector/orders", json!([1, 1])),
        ("/projector/orders", json!([21])),
        ("/poses/0", json!({"laser": "laser/000.png"})),
        ("/poses/0/board", json!("../x.png")),
        ("/poses/0/board", json!("/x.png")),
        ("/stage_views/0/position_mm", json!(null)),
        ("/stage_views/0", json!({"board": "stage/000.png"})),
        ("/stage_views/0", json!({"board": "stage/000.png", "angle_deg": 1})),
        ("/stage_views/0", json!({"board": "stage/000.png", "angle_deg": 1, "position_mm": 1})),
        ("/scans/0/frames/0", json!({"image": "scan/000.png", "angle_deg": 5})),
        ("/scans/0/name", json!("")),
        ("/stage", json!({"kind": "tilting"})),
        ("/stage", json!({"angle_sigma_deg": 0.1})),
    ];
    for (pointer, value) in broken {
        let manifest = match pointer {
            "/stage" => manifest_of_stage(value.clone()),
            _ => manifest_with(pointer, value.clone()),
        };
        assert!(!schema.is_valid(&manifest), "{pointer} {value}");
        refusal(folder_with(&manifest).path());
    }
}

/// The valid manifest with another kind of stage.
fn manifest_of_stage(stage: Value) -> Value {
    let mut manifest = valid_manifest();
    manifest["stage"] = stage;
    manifest
}

#[test]
fn schema_and_reader_require_angles_for_a_turntable() {
    let mut manifest = manifest_of_stage(json!({"kind": "rotary", "angle_sigma_deg": 0.05}));
    assert!(!schema().is_valid(&manifest), "positions on a turntable");
    refusal(folder_with(&manifest).path());
    manifest["stage_views"] = json!([{"board": "stage/000.png", "angle_deg": -20}]);
    manifest["scans"][0]["frames"] = json!([{"image": "scan/000.png", "angle_deg": 370.5}]);
    assert!(schema().is_valid(&manifest));
    let capture = Capture::open(folder_with(&manifest).path()).unwrap();
    assert_eq!(capture.manifest.scans[0].frames[0].position(), capture::NominalPosition::AngleDeg(370.5));
    assert!(schema().is_valid(&serde_json::to_value(&capture.manifest).unwrap()));
}

#[test]
fn rig_a_fits_the_schema_and_opens() {
    let Some(rig) = reference::data("rig-a") else { return };
    let text = std::fs::read_to_string(rig.join("capture.json")).unwrap();
    let manifest: Value = serde_json::from_str(&text).unwrap();
    let errors: Vec<String> = schema().iter_errors(&manifest).map(|error| error.to_string()).collect();
    assert_eq!(errors, Vec::<String>::new());
    let capture = Capture::open(&rig).unwrap();
    assert_eq!(capture.warnings, Vec::<String>::new());
    assert_eq!((capture.manifest.poses.len(), capture.files().len()), (12, 12 * 2 + 5 + 80));
    let image = capture.image("poses[0].laser", &capture.manifest.poses[0].laser.clone().unwrap()).unwrap();
    assert_eq!((image.width(), image.height(), image.bit_depth()), (1280, 1024, 8));
}
