//! A station with independent lasers instead of a grating: configured, calibrated in a session, scanned and measured.
//!
//! Not shown here: lines that cross, and lasers that are switched on one by one; a station has neither.

use serde_json::{Value, json};

use super::targets::Session;

/// Corners of the simulated station's board.
const CORNERS: usize = 88;

/// Radius of the simulated ball.
const RADIUS_MM: f64 = 18.9;

/// The walk from the configuration to a measured ball; returns the reason codes of the watches.
#[track_caller]
fn check(lines: usize) -> Vec<Value> {
    let count = format!("projector.lines={lines}");
    let session = Session::begun(&["projector.kind=planes", &count]);
    let projector = json!({ "kind": "planes", "lines": lines, "line_direction": "rows" });
    assert_eq!(session.get()["body"]["projector"], projector);
    session.gather(CORNERS);
    for pose in session.get()["body"]["poses"].as_array().unwrap() {
        assert!(pose["laser"]["n_segments"].as_u64().unwrap() >= lines as u64, "{}", pose["laser"]);
    }
    let calibration = session.solve();
    let document = &calibration["calibration"];
    assert_eq!(document["light"]["model"], "planes");
    assert_eq!(document["light"]["planes"].as_array().unwrap().len(), lines);
    assert_eq!(document["orders"], json!((0..lines).collect::<Vec<_>>()));
    assert_eq!(document["report"]["light"]["wavelength_over_period"], Value::Null, "no grating is invented");
    let (scan, (radius_mm, expanded_mm)) = session.measured_over(20.0, &calibration, "sphere");
    println!("{lines} lasers: sphere {radius_mm:.4} mm ± {expanded_mm:.4} mm, true {RADIUS_MM} mm");
    assert!((radius_mm - RADIUS_MM).abs() < expanded_mm, "{radius_mm} mm ± {expanded_mm} mm");
    let report = &session.server.get(&format!("/api/v1/scans/{scan}")).expect(200)["report"];
    println!("{lines} lasers: {report:#}");
    let watches = report["watches"].as_array().unwrap_or_else(|| panic!("{report:#}"));
    watches.iter().map(|verdict| verdict["reason_code"].clone()).collect()
}

#[test]
fn a_station_with_one_laser_is_calibrated_and_measures_the_ball() {
    assert_eq!(check(1), vec![json!("one_line"); 4], "every watch says that it needs two sheets");
}

#[test]
fn a_station_with_two_lasers_is_calibrated_and_measures_the_ball() {
    let codes = check(2);
    assert!(codes.contains(&json!("no_wavelength")) && !codes.contains(&json!("one_line")), "{codes:?}");
}

#[test]
fn an_impossible_projector_is_refused_with_its_entry() {
    let session = Session::begun(&[]);
    let refused = |projector: Value| {
        let body = json!({ "projector": projector });
        let problem = session.server.post("/api/v1/calibration-sessions", &body).expect(422);
        (problem["pointer"].clone(), problem["remedy"].as_str().unwrap_or_default().to_owned())
    };
    let (pointer, remedy) = refused(json!({ "kind": "planes", "lines": 0 }));
    assert_eq!(pointer, "/projector/lines");
    assert!(remedy.contains("1 to 41"), "{remedy}");
    let grating = json!({ "wavelength_nm": 0, "grating_lines_per_mm": 50, "orders": [0] });
    assert_eq!(refused(grating).0, "/projector/wavelength_nm");
    let (pointer, remedy) = refused(json!({ "kind": "cross" }));
    assert_eq!(pointer, "/projector/kind");
    assert!(remedy.contains("from a capture"), "{remedy}");
}
