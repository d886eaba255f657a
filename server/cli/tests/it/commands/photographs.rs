//! Published photographs, processed with the binary: real light, lenses and noise.
//!
//! Not shown here: a multi-line set with a calibration; none is published, the rendered station replaces it.

use std::path::{Path, PathBuf};

use crate::common::{path, sheaf, sheaf_json, sheaf_ok};
use serde_json::{Value, json};
use tempfile::TempDir;

/// RMS of the left camera with k3 = 0: OpenCV reaches 0.178 px with the same model.
const OPENCV_LEFT_RMS_PX: f64 = 0.180;
/// RMS of the ciclop camera: OpenCV and the published calibration reach 0.2415 px.
const CICLOP_RMS_PX: f64 = 0.2420;
/// Published focal length and principal point, px; the choice of detector changes them by a fraction of this tolerance.
const CICLOP_PUBLISHED: [(&str, f64, f64); 4] =
    [("fx_px", 1430.391, 5.0), ("fy_px", 1429.663, 5.0), ("cx_px", 636.404, 4.0), ("cy_px", 478.033, 4.0)];
/// Minimum fraction of the rows of a lit surface on which its line is detected.
const COVERAGE: f64 = 0.90;
/// Maximum length of a run of noise: the shortest piece of the profile of the bust has 30 rows.
const NOISE_ROWS: usize = 30;
/// Maximum distance of a point of a line from the straight line between its ends: lens distortion and warping of the board
/// cause less.
const ON_LINE_PX: f64 = 3.0;

/// Photographs of a board, in order of name.
fn boards(folder: &str, prefix: &str, count: usize) -> Option<Vec<PathBuf>> {
    let mut images: Vec<PathBuf> = std::fs::read_dir(reference::data(folder)?)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(prefix))
        .filter(|path| path.extension().is_some_and(|extension| extension == "jpg"))
        .collect();
    images.sort();
    assert_eq!(images.len(), count, "photographs in {folder}");
    Some(images)
}

#[track_caller]
fn every_board_is_found(images: &[PathBuf], columns: usize, rows: usize) {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["corners".to_owned()];
    arguments.extend(images.iter().map(|image| image.display().to_string()));
    let numbers = [columns.to_string(), rows.to_string()];
    arguments.extend(["--columns", &numbers[0], "--rows", &numbers[1], "-q", "--csv"].map(str::to_owned));
    arguments.push(path(folder.path(), ""));
    let (result, exit) = sheaf_json(&arguments);
    assert_eq!(exit, 0, "{result:#}");
    let found = result["images"].as_array().unwrap();
    assert_eq!(found.len(), images.len());
    for image in found {
        assert_eq!(image["n_corners"], columns * rows, "{image:#}");
    }
}

#[test]
fn every_board_of_the_opencv_set_is_detected() {
    let Some(images) = boards("real/opencv-board", "left", 13) else { return };
    every_board_is_found(&images, 9, 6);
}

#[test]
fn every_board_of_the_ciclop_set_is_detected() {
    let Some(images) = boards("real/ciclop/camera", "frame", 16) else { return };
    every_board_is_found(&images, 11, 6);
}

/// A capture of board images only, as grey PNG; `turned` by 90° as for the published result.
fn capture_of(images: &[PathBuf], inner: [usize; 2], square_mm: f64, turned: bool) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut size = (0, 0);
    let poses: Vec<Value> = images
        .iter()
        .enumerate()
        .map(|(idx, image)| {
            let name = format!("{idx:03}.png");
            let mut grey = image::open(image).unwrap().into_luma8();
            if turned {
                grey = image::imageops::rotate90(&grey);
            }
            size = grey.dimensions();
            grey.save(folder.path().join(&name)).unwrap();
            json!({ "board": name })
        })
        .collect();
    let manifest = json!({
        "format": "sheaf-capture/1",
        "camera": { "width_px": size.0, "height_px": size.1 },
        "target": { "kind": "chessboard", "inner_columns": inner[0], "inner_rows": inner[1], "square_mm": square_mm },
        "projector": { "wavelength_nm": 660, "grating_lines_per_mm": 50, "orders": [-1, 0, 1] },
        "poses": poses,
    });
    std::fs::write(folder.path().join("capture.json"), manifest.to_string()).unwrap();
    folder
}

fn camera_of(capture: &TempDir, options: &[&str]) -> Value {
    let output = path(capture.path(), "cal.json");
    let folder = capture.path().display().to_string();
    let mut arguments = vec!["calibrate", &folder, "-o", &output, "-q"];
    arguments.extend(options);
    let (result, exit) = sheaf_json(&arguments);
    assert_eq!(exit, 0, "{result:#}");
    println!("camera RMS {} px", result["camera"]["rms_px"]);
    result["camera"].clone()
}

#[test]
fn the_opencv_camera_is_calibrated_to_opencvs_residual() {
    let Some(images) = boards("real/opencv-board", "left", 13) else { return };
    let camera = camera_of(&capture_of(&images, [9, 6], 25.0, false), &["--k3", "zero"]);
    let rms_px = camera["rms_px"].as_f64().unwrap();
    assert!((0.05..=OPENCV_LEFT_RMS_PX).contains(&rms_px), "{rms_px}");
}

#[test]
fn the_ciclop_camera_agrees_with_the_published_one() {
    let Some(images) = boards("real/ciclop/camera", "frame", 16) else { return };
    let camera = camera_of(&capture_of(&images, [11, 6], 13.0, true), &[]);
    let rms_px = camera["rms_px"].as_f64().unwrap();
    assert!((0.05..=CICLOP_RMS_PX).contains(&rms_px), "{rms_px}");
    for (name, published, tolerance) in CICLOP_PUBLISHED {
        let value = camera["parameters"][name]["value"].as_f64().unwrap();
        assert!((value - published).abs() < tolerance, "{name}: {value}, published {published}");
    }
}

/// Points (u, v) of one photograph after background subtraction.
fn points_of(on: &str, off: &str) -> Option<Vec<[f64; 2]>> {
    let ciclop = reference::data("real/ciclop")?;
    let folder = tempfile::tempdir().unwrap();
    let (on, off) = (path(&ciclop, on), path(&ciclop, off));
    let csv = path(folder.path(), "");
    sheaf_ok(&["centrelines", &on, "--background", &off, "--line-direction", "columns", "--csv", &csv, "-q"]);
    let name = Path::new(&on).with_extension("csv");
    let text = std::fs::read_to_string(folder.path().join(name.file_name().unwrap())).unwrap();
    let points = text.lines().skip(1).map(|row| {
        let mut fields = row.split(',').map(|field| field.parse().unwrap());
        [fields.next().unwrap(), fields.next().unwrap()]
    });
    Some(points.collect())
}

/// Fraction of the rows between `from` and `to` (u, v) with a point on the straight line between them.
fn coverage(points: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> f64 {
    let rows: std::collections::BTreeSet<i64> = points
        .iter()
        .filter(|[_, v]| (from[1]..=to[1]).contains(v))
        .filter(|[u, v]| {
            let share = (v - from[1]) / (to[1] - from[1]);
            (u - from[0] - share * (to[0] - from[0])).abs() < ON_LINE_PX
        })
        .map(|[_, v]| v.round() as i64)
        .collect();
    rows.len() as f64 / (to[1] - from[1] + 1.0)
}

#[test]
fn both_laser_lines_on_the_chessboard_are_followed_from_edge_to_edge() {
    // Ends of the lines on the board, read manually from the photographs to two pixels.
    let sets = [
        ("0-255-255-8", [([277.0, 455.0], [271.5, 1035.0]), ([596.0, 461.0], [584.0, 1020.0])]),
        ("0-255-255-8-x", [([313.5, 459.0], [314.5, 1016.0]), ([647.0, 451.0], [629.0, 1035.0])]),
    ];
    for (name, lines) in sets {
        let on = format!("laser_on_pattern/laser-{name}.png");
        let off = format!("laser_on_pattern/laser-background-{name}.png");
        let Some(points) = points_of(&on, &off) else { return };
        for (from, to) in lines {
            let share = coverage(&points, from, to);
            println!("{name}: line from {from:?} to {to:?}: {share:.3} of the rows");
            assert!(share >= COVERAGE, "{name}: {share}");
        }
    }
}

#[test]
fn the_profile_of_the_bust_is_followed_from_helmet_to_base() {
    let Some(points) = points_of("laser_on_object/laser.png", "laser_on_object/laser_background.png") else {
        return;
    };
    // The strip of the image that contains the line, from the crest of the helmet to the edge of the base.
    let (first, last) = (63, 1118);
    let rows: std::collections::BTreeSet<i64> =
        points.iter().filter(|[u, _]| (505.0..605.0).contains(u)).map(|[_, v]| v.round() as i64).collect();
    let share = rows.range(first..=last).count() as f64 / f64::from(last as i32 - first as i32 + 1);
    println!("bust: {share:.3} of the rows");
    assert!(share >= COVERAGE, "{share}");
    let elsewhere: Vec<[f64; 2]> = points
        .into_iter()
        .filter(|[u, _]| !(505.0..605.0).contains(u))
        // The laser also lights the edge of the turntable.
        .filter(|[u, v]| !((770.0..785.0).contains(u) && *v > 1200.0))
        .collect();
    let longest = longest_run(&elsewhere);
    println!("bust: {} points of noise, the longest run {longest} rows", elsewhere.len());
    assert!(longest < NOISE_ROWS, "a line of {longest} rows where the laser is not");
}

/// Number of rows of the longest run of consecutive points.
fn longest_run(points: &[[f64; 2]]) -> usize {
    let next = |a: &[f64; 2], b: &[f64; 2]| (b[1] - a[1]).abs() < 3.0 && (b[0] - a[0]).abs() < 3.0;
    points.chunk_by(next).map(<[_]>::len).max().unwrap_or(0)
}

#[test]
fn without_a_background_the_laser_is_identified_by_its_colour() {
    let Some(ciclop) = reference::data("real/ciclop") else { return };
    let folder = tempfile::tempdir().unwrap();
    let images =
        ["laser_on_object/laser.png", "laser_on_pattern/laser-0-255-255-8.png"].map(|on| path(&ciclop, on));
    for (image, lines) in [
        (&images[0], &[][..]),
        (&images[1], &[([277.0, 455.0], [271.5, 1035.0]), ([596.0, 461.0], [584.0, 1020.0])][..]),
    ] {
        let out = path(folder.path(), "out");
        let (result, exit) = sheaf_json(&["centrelines", image, "-o", &out, "--direction", "columns", "-q"]);
        println!("{}", result["channel"]);
        let channel = result["channel"]["name"].as_str().unwrap();
        assert!(exit == 0 && channel.starts_with("red"), "{result:#}");
        let table = Path::new(&out).join(Path::new(image).with_extension("csv").file_name().unwrap());
        let text = std::fs::read_to_string(table).unwrap();
        let points: Vec<[f64; 2]> = text
            .lines()
            .skip(1)
            .map(|row| [0, 1].map(|field| row.split(',').nth(field).unwrap().parse().unwrap()))
            .collect();
        for &(from, to) in lines {
            let share = coverage(&points, from, to);
            println!("line from {from:?} to {to:?}: {share:.3} of the rows without a background");
            assert!(share >= COVERAGE, "{share}");
        }
        if lines.is_empty() {
            let rows: std::collections::BTreeSet<i64> =
                points.iter().filter(|[u, _]| (505.0..605.0).contains(u)).map(|[_, v]| v.round() as i64).collect();
            let share = rows.range(63..=1118).count() as f64 / 1056.0;
            println!("bust: {share:.3} of the rows without a background");
            assert!(share >= COVERAGE, "{share}");
        }
    }
}

#[test]
fn a_background_of_another_size_is_refused() {
    let (Some(ciclop), Some(opencv)) = (reference::data("real/ciclop"), reference::data("real/opencv-board"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (on, off) = (path(&ciclop, "laser_on_object/laser.png"), path(&opencv, "left01.jpg"));
    let output = sheaf(&["centrelines", &on, "--background", &off, "--csv", &path(folder.path(), ""), "-q"]);
    let message = crate::common::err(&output);
    assert_eq!(output.status.code(), Some(3), "{message}");
    for word in ["960×1280", "640×480", "left01.jpg", "remedy: "] {
        assert!(message.contains(word), "`{word}` is not in:\n{message}");
    }
}
