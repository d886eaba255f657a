//! Calibration, scan and measurement with the rendered images of a hobby rig (two lasers, a camera, a turntable).

use std::path::Path;

use crate::common::{edit_manifest, err, path, sheaf, sheaf_json, sheaf_ok};
use drawn::{AXIS, CYLINDER_MM};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Maximum error of the axis in its σ.
const SIGMAS: f64 = 4.0;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// A capture of two lasers and a turntable is calibrated and scanned, and its cylinder measured, within what they state.
pub fn measures_true(folder: &Path) {
    let (capture, calibration) = (path(folder, ""), path(folder, "cal.json"));
    let (cloud, page) = (path(folder, "part.ply"), path(folder, "page.html"));
    let (made, exit) = sheaf_json(&["calibrate", &capture, "-o", &calibration, "--report", &page, "-q"]);
    assert_eq!(exit, 0, "{made:#}");
    check_axis(&made["axis"]);
    assert!(std::fs::read_to_string(&page).unwrap().contains("Turntable"));
    crate::commands::schemas::follows("calibration", Path::new(&calibration));
    let (scan, exit) = sheaf_json(&["scan", &capture, "-c", &calibration, "--scan", "part", "-o", &cloud, "-q"]);
    assert_eq!(exit, 0, "{scan:#}");
    println!("{} points, closure {}", scan["n_points"], scan["closure"]);
    for gap in ["same_line", "other_lines"] {
        let rms_mm = scan["closure"][gap]["rms_mm"].as_f64().unwrap();
        assert!(rms_mm < 0.1, "{gap}: {scan:#}");
    }
    let (measured, _) = sheaf_json(&["measure", &cloud, "--tool", "cylinder", "-q"]);
    let [value, u] = ["value", "expanded_uncertainty"].map(|key| measured[key].as_f64().unwrap());
    println!("radius {value:.4} ± {u:.4} mm");
    assert!((value - CYLINDER_MM[0]).abs() < u && u < 0.2, "{measured:#}");
    let text = sheaf_ok(&["scan", &capture, "-c", &calibration, "--scan", "part", "-o", &cloud, "-q"]);
    assert!(crate::common::out(&text).contains("closure after a turn, other line"));
    the_axis_does_not_follow_from_a_plain_part(folder);
    a_linear_frame_is_refused(folder, &calibration);
}

/// A cylinder 3 mm beside the axis does not determine it to more than 0.4 mm: what is lacking is said, and no calibration is
/// written. Parts that do are in `scanning/tests/it/part_axis.rs`.
fn the_axis_does_not_follow_from_a_plain_part(folder: &Path) {
    edit_manifest(folder, |manifest| manifest["stage_views"] = json!([]));
    let (capture, calibration, turning) =
        (path(folder, ""), path(folder, "plain.json"), path(folder, "turning.json"));
    let (made, exit) = sheaf_json(&["calibrate", &capture, "-o", &calibration, "-q"]);
    assert!(exit == 0 && made["axis"].is_null(), "{made:#}");
    let axis = ["axis", &capture, "-c", &calibration, "--scan", "part", "-o", &turning, "-q"];
    // The middle of the depth range is centimetres from the axis.
    for (near_mm, what, remedy) in [
        (None, "observed twice", "start within a few millimetres of the axis"),
        (Some("2,0,297"), "the axis is too uncertain", "a larger part with more relief"),
    ] {
        let near = near_mm.map(|at| ["--near-mm", at]);
        let arguments: Vec<&str> = axis.iter().copied().chain(near.into_iter().flatten()).collect();
        let refused = sheaf(&arguments);
        let message = err(&refused);
        assert!(!refused.status.success() && message.contains(what) && message.contains(remedy), "{message}");
        assert!(!Path::new(&turning).exists());
    }
}

/// Asserts that point and direction are within their σ of the truth.
fn check_axis(found: &Value) {
    let (point, direction) = (numbers(&found["point_mm"]), numbers(&found["direction"]));
    let (point, direction) = (Vector3::from_column_slice(&point), Vector3::from_column_slice(&direction));
    let (first, second) = optics::rotation::completing_frame(&direction);
    let off = AXIS.with_point_near(&point).point_mm - point;
    let (shifts, tilts) = (numbers(&found["shift_sigma_mm"]), numbers(&found["tilt_sigma_deg"]));
    for (way, (shift_mm, tilt_deg)) in [first, second].iter().zip(shifts.iter().zip(&tilts)) {
        let (shift, tilt) = (way.dot(&off) / shift_mm, way.dot(&AXIS.direction).to_degrees() / tilt_deg);
        println!("shift {:.4} mm = {shift:.2} σ, tilt {tilt:.2} σ of {tilt_deg:.4}°", way.dot(&off));
        assert!(shift.abs() < SIGMAS && tilt.abs() < SIGMAS, "{found:#}");
    }
}

fn a_linear_frame_is_refused(folder: &Path, calibration: &str) {
    edit_manifest(folder, |manifest| manifest["scans"][0]["frames"][3]["position_mm"] = json!(1.0));
    let (capture, cloud) = (path(folder, ""), path(folder, "no.ply"));
    let refused = sheaf(&["scan", &capture, "-c", calibration, "--scan", "part", "-o", &cloud, "-q"]);
    assert!(!refused.status.success());
    let message = err(&refused);
    assert!(
        message.contains("scans[0].frames[3].position_mm") && message.contains("angle_deg instead"),
        "{message}"
    );
}
