//! `sheaf bench`: every subject runs and states its figures.

use serde_json::Value;

use crate::common::{out, path, sheaf_ok, small_calibration, small_capture};

/// The figures of a benchmark.
fn figures(arguments: &[&str]) -> Value {
    serde_json::from_str(&out(&sheaf_ok(&[&["bench"], arguments, &["--json", "-"]].concat()))).unwrap()
}

#[test]
fn the_whole_service_keeps_every_frame_of_a_replayed_capture() {
    let folder = tempfile::tempdir().unwrap();
    let (capture, calibration) = (small_capture(), small_calibration());
    let [capture, calibration, place] = [&capture, &calibration, folder.path()].map(|one| one.to_str().unwrap());
    let load = ["--frames", "40", "--rate-hz", "25", "--sweeps", "2", "--viewers", "2", "--folder", place];
    let figures = figures(&[&["server", capture, "--calibration", calibration], &load[..]].concat());
    let sweeps = figures["sweeps"].as_array().unwrap();
    assert_eq!(sweeps.len(), 2);
    for sweep in sweeps {
        assert_eq!((&sweep["n_frames"], sweep["losses"].as_array().unwrap().len()), (&40.into(), 0), "{sweep}");
        assert!(sweep["profiles_per_s"].as_f64().unwrap() > 0.0, "{sweep}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn labels_of_the_frames_of_a_capture_are_timed() {
    let frame = path(&small_capture(), "scan-gauge/00000.png");
    let figures = figures(&["profiles", "--calibration", small_calibration().to_str().unwrap(), &frame]);
    assert!(figures["label_ms"].as_f64().unwrap() > 0.0, "{figures}");
}

#[test]
fn bench_cloud_reports_memory_and_speed_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().to_str().unwrap();
    let figures = figures(&["cloud", "--frames", "12", "--points", "500", "--folder", place]);
    assert_eq!(figures["n_points"], 6000);
    for speed in ["ply_mb_s", "encoded_mb_s", "disk_mb_s", "seconds"] {
        assert!(figures[speed].as_f64().unwrap() > 0.0, "{figures}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn bench_writes_its_figures_to_a_file_and_the_points_of_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let frame = folder.path().join("line.png");
    let line = |_: u32, v: u32| image::Luma([5 + (200.0 * (-0.125 * (f64::from(v) - 40.3).powi(2)).exp()) as u8]);
    image::GrayImage::from_fn(160, 96, line).save(&frame).unwrap();
    let (json, points) = (folder.path().join("out.json"), folder.path().join("points"));
    let of = |path: &std::path::Path| path.to_str().unwrap().to_owned();
    let arguments =
        ["bench", "centrelines", "--threads", "1", "--json", &of(&json), "--points", &of(&points), &of(&frame)];
    assert!(out(&sheaf_ok(&arguments)).contains("160×96"));
    let figures: Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert!(figures["median_ms"].as_f64().unwrap() > 0.0 && figures["read_ms"].as_f64().unwrap() > 0.0);
    let table = std::fs::read_to_string(points.join("line.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows[0], "u_px,v_px");
    assert!(rows.len() > 150);
    for row in &rows[1..] {
        let v_px: f64 = row.split(',').nth(1).unwrap().parse().unwrap();
        // Levels are truncated, by half a level on average, on a line of 200.
        assert!((v_px - 40.3).abs() < 0.05, "{row}");
    }
}
