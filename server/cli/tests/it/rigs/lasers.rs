//! One and two lasers without a grating, calibrated and scanned with the command line and compared with ground truth.
//!
//! The images are those of the simulated station: order 0 of a grating is a plane. The second laser is a second station
//! with the same camera, boards, parts and stage, whose light is added image by image.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;

use crate::common::{path, sheaf, sheaf_json, sheaf_ok};
use capture::{PlanesProjector, Projector, read_grey_image, write_manifest, write_png};
use nalgebra::{Rotation3, Vector3};
use scanning::files::read_cloud;
use serde_json::json;
use tempfile::TempDir;
use twin::{CaptureRequest, ScanRequest, SceneKind, StationModel, StationShape, capture_folder};
use vision::{GreyImage, LineDirection, Pixels};

/// Angle between the lasers about the x axis of the camera.
const APART_RAD: f64 = 0.09;
/// Maximum median of the depth error in σ; that of a Gaussian is 0.67.
const MEDIAN_SIGMAS: f64 = 1.0;
/// Depth error from which a point has the wrong line or none: ten times the noise.
const WRONG_MM: f64 = 1.0;
/// Fraction of the true points that must be found.
const RECALL: f64 = 0.95;
/// Maximum distance along the line between compared points of truth and cloud.
const SAME_COLUMN_PX: f64 = 0.5;
/// Maximum distance across the line: three line widths.
const SAME_LINE_PX: f64 = 6.0;

/// A station whose light is one plane, rotated about the x axis of the camera by `turn_rad`.
fn station(turn_rad: f64) -> StationModel {
    let shape = StationShape { width_px: 960, height_px: 768, orders: vec![0], ..StationShape::default() };
    let mut model = StationModel::seeded(11, &shape).unwrap();
    let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), turn_rad);
    for part in
        [&mut model.grating.axis, &mut model.grating.fan, &mut model.grating.normal, &mut model.grating.groove]
    {
        *part = turn * *part;
    }
    model
}

pub(super) fn recorded(model: &StationModel, folder: &Path) {
    let request = CaptureRequest {
        n_poses: 8,
        stage_positions: vec![-15.0, -5.0, 5.0, 15.0],
        scans: vec![ScanRequest {
            name: "gauge".to_owned(),
            part: SceneKind::Gauge { height_mm: 8.9 },
            n_frames: 16,
            step: 1.0,
        }],
    };
    capture_folder(model, &request, folder, &|_| ControlFlow::Continue(())).unwrap();
}

/// A capture with one plane of light per turn, listed from the top of the image.
fn capture(turns_rad: &[f64]) -> TempDir {
    let lines = turns_rad.len();
    let planes = PlanesProjector { lines, line_direction: None, switched: false };
    let models: Vec<StationModel> = turns_rad.iter().copied().map(station).collect();
    capture_of(&models, Projector::Planes(planes))
}

/// A capture whose images show the light of all stations.
pub(super) fn capture_of(models: &[StationModel], projector: Projector) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (line, model) in models.iter().enumerate() {
        recorded(model, &folder.path().join(line.to_string()));
    }
    let first = folder.path().join("0");
    let mut made = capture::Capture::open(&first).unwrap();
    let lit: Vec<_> = made.files().into_iter().filter(|file| !file.entry.ends_with("board")).collect();
    for line in 1..models.len() {
        for file in &lit {
            let other = read_grey_image(&folder.path().join(line.to_string()).join(&file.path)).unwrap();
            let sum = added(&read_grey_image(&first.join(&file.path)).unwrap(), &other);
            write_png(&first.join(&file.path), &sum).unwrap();
        }
    }
    made.manifest.projector = projector;
    write_manifest(&first, &made.manifest).unwrap();
    folder
}

fn added(a: &GreyImage, b: &GreyImage) -> GreyImage {
    let (Pixels::Eight(of_a), Pixels::Eight(of_b)) = (a.pixels(), b.pixels()) else { panic!("8 bits") };
    let sum = of_a.iter().zip(of_b).map(|(a, b)| a.saturating_add(*b)).collect();
    GreyImage::new(a.width(), a.height(), Pixels::Eight(sum)).unwrap()
}

/// The same with lasers that are switched on one at a time, each with its own images.
fn switched(turns_rad: &[f64]) -> TempDir {
    let models: Vec<StationModel> = turns_rad.iter().copied().map(station).collect();
    let planes = PlanesProjector { lines: models.len(), line_direction: None, switched: true };
    switched_of(&models, Projector::Planes(planes))
}

/// A capture in which each station has its own laser images.
pub(super) fn switched_of(models: &[StationModel], projector: Projector) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (line, model) in models.iter().enumerate() {
        recorded(model, &folder.path().join(line.to_string()));
    }
    let first = folder.path().join("0");
    let mut made = capture::Capture::open(&first).unwrap();
    let of_line = |path: &Path, line: usize| match line {
        0 => path.to_owned(),
        _ => {
            let name = path.with_extension(format!("{line}.png"));
            std::fs::copy(folder.path().join(line.to_string()).join(path), first.join(&name)).unwrap();
            name
        }
    };
    let lines = models.len();
    for pose in &mut made.manifest.poses {
        let laser = pose.laser.take().unwrap();
        pose.lasers = (0..lines).map(|line| of_line(&laser, line)).collect();
    }
    for scan in &mut made.manifest.scans {
        let of_frame = |frame: &capture::Frame| -> Vec<capture::Frame> {
            let of = |line: usize| {
                let image = of_line(&frame.image, line);
                capture::Frame { image, line: Some(line as i8), ..frame.clone() }
            };
            (0..lines).map(of).collect()
        };
        scan.frames = scan.frames.iter().flat_map(of_frame).collect();
    }
    made.manifest.projector = projector;
    write_manifest(&first, &made.manifest).unwrap();
    folder
}

/// Calibrates and scans, and compares every point with the truth of its frame and line; `per_row`: frames per row.
fn check(folder: &TempDir, turns_rad: &[f64], per_row: u32) {
    check_lines(folder, &vec![LineDirection::Rows; turns_rad.len()], per_row, &station(0.0));
}

/// The same for lines along these directions; `station` provides the stage.
pub(super) fn check_lines(folder: &TempDir, directions: &[LineDirection], per_row: u32, station: &StationModel) {
    let capture = path(folder.path(), "0");
    let (calibration, cloud) = (path(folder.path(), "cal.json"), path(folder.path(), "gauge.ply"));
    let (result, exit) = sheaf_json(&["calibrate", &capture, "-o", &calibration, "-q"]);
    assert_eq!(exit, 0, "{result:#}");
    assert_eq!(result["light"]["model"], "planes");
    sheaf_ok(&["scan", &capture, "-c", &calibration, "--scan", "gauge", "-o", &cloud, "-q"]);
    let points = read_cloud(Path::new(&cloud)).unwrap().points;
    let mut by_line: BTreeMap<(u32, i8), Vec<[f64; 4]>> = BTreeMap::new();
    for point in points {
        // The stage moves along y: depths in the part frame equal those in the camera frame except for its tilt.
        let at = [f64::from(point.u_px), f64::from(point.v_px), point.z_mm, f64::from(point.sigma_mm)];
        by_line.entry((point.frame / per_row, point.order)).or_default().push(at);
    }
    let stage = station.stage.linear().unwrap();
    let (mut n_true, mut n_found, mut n_wrong, mut z) = (0, 0, 0, Vec::new());
    for (line, direction) in directions.iter().enumerate() {
        let text = std::fs::read_to_string(folder.path().join(line.to_string()).join("truth-gauge.csv")).unwrap();
        for row in text.lines().skip(1).step_by(7) {
            let row: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
            let (frame, u_px, v_px, z_mm) = (row[0] as u32, row[2], row[3], row[6]);
            n_true += 1;
            let near = |at: &&[f64; 4]| {
                let (along, across) = match direction {
                    LineDirection::Rows => (at[0] - u_px, at[1] - v_px),
                    LineDirection::Columns => (at[1] - v_px, at[0] - u_px),
                };
                along.abs() < SAME_COLUMN_PX && across.abs() < SAME_LINE_PX
            };
            let Some(at) = by_line.get(&(frame, line as i8)).and_then(|of_line| of_line.iter().find(near)) else {
                continue;
            };
            n_found += 1;
            let position_mm = f64::from(frame) - 7.5;
            let error_mm = at[2] + stage.direction.z * position_mm - z_mm;
            n_wrong += usize::from(error_mm.abs() > WRONG_MM);
            z.push(error_mm.abs() / at[3]);
        }
    }
    z.sort_by(f64::total_cmp);
    let median = z[z.len() / 2];
    println!("{directions:?}: {n_found} of {n_true} found, {n_wrong} wrong, median {median:.2} σ");
    assert!(n_found as f64 >= RECALL * n_true as f64, "{n_found} of {n_true}");
    assert_eq!(n_wrong, 0);
    assert!(median < MEDIAN_SIGMAS, "{median}");
}

#[test]
fn one_laser_is_calibrated_and_scans() {
    check(&capture(&[0.0]), &[0.0], 1);
}

#[test]
fn two_free_lasers_are_calibrated_and_scan() {
    let turns_rad = [APART_RAD / 2.0, -APART_RAD / 2.0];
    check(&capture(&turns_rad), &turns_rad, 1);
}

#[test]
fn lasers_switched_on_one_at_a_time_are_identified_by_their_images() {
    // Numbered from the bottom upwards: by position they would be swapped.
    let turns_rad = [-APART_RAD / 2.0, APART_RAD / 2.0];
    let folder = switched(&turns_rad);
    check(&folder, &turns_rad, 2);
    let capture = path(folder.path(), "0");
    crate::commands::schemas::follows("capture", &folder.path().join("0/capture.json"));
    crate::common::edit_manifest(&folder.path().join("0"), |manifest| {
        manifest["scans"][0]["frames"][3].as_object_mut().unwrap().remove("line");
    });
    let (calibration, cloud) = (path(folder.path(), "cal.json"), path(folder.path(), "no.ply"));
    let refused = sheaf(&["scan", &capture, "-c", &calibration, "--scan", "gauge", "-o", &cloud, "-q"]);
    let message = crate::common::err(&refused);
    assert!(!refused.status.success());
    for words in ["scans[0].frames[3].line is missing", "state which line was on"] {
        assert!(message.contains(words), "`{words}` is not in:\n{message}");
    }
}

#[test]
fn grating_models_are_refused_for_lasers_without_a_grating() {
    let folder = capture(&[0.0]);
    let capture = path(folder.path(), "0");
    let output = path(folder.path(), "cal.json");
    let refused = sheaf(&["calibrate", &capture, "-o", &output, "--light-model", "grating", "-q"]);
    let message = crate::common::err(&refused);
    assert!(!refused.status.success() && message.contains("without a grating"), "{message}");
}

#[test]
fn a_missing_entry_is_reported_with_the_entry_to_write() {
    let folder = crate::common::copy_of_small();
    crate::common::edit_manifest(folder.path(), |manifest| manifest["projector"] = json!({ "orders": [0] }));
    let output = sheaf(&["calibrate", folder.path().to_str().unwrap(), "-o", "x.json", "-q"]);
    let message = crate::common::err(&output);
    for words in ["projector.wavelength_nm is missing", "remedy: add it from the data sheets", "kind \"planes\""] {
        assert!(message.contains(words), "`{words}` is not in:\n{message}");
    }
}
