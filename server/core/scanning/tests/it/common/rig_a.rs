//! The rendered station `rig-a` with its true calibration.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{DMatrix, Vector3};
use optics::{Calibration, Camera, DepthRangeMm, Grating, LightSurfaces, StageAxis, StagePosition};
use scanning::ScanFrame;
use serde_json::Value;
use vision::LineDirection;

use super::{KnownScan, centrelines, segments};

pub fn json(path: &std::path::Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// The true calibration of the station.
pub fn calibration(folder: &std::path::Path) -> Calibration {
    let truth = json(&folder.join("truth.json"));
    let capture = json(&folder.join("capture.json"));
    let vector = |name: &str| Vector3::from_vec(numbers(&truth[name]));
    let k = numbers(&truth["K"]);
    let projector = &capture["projector"];
    let orders: Vec<i8> = numbers(&projector["orders"]).iter().map(|order| *order as i8).collect();
    let grating = Grating {
        source_mm: vector("S"),
        axis: vector("axis"),
        fan: vector("fan"),
        normal: vector("normal"),
        groove: vector("groove"),
        gap_mm: truth["gap"].as_f64().unwrap(),
        wavelength_over_period: projector["wavelength_nm"].as_f64().unwrap()
            * 1e-6
            * projector["grating_lines_per_mm"].as_f64().unwrap(),
    };
    let matrix = [[k[0], 0.0, k[2]], [0.0, k[1], k[3]], [0.0, 0.0, 1.0]];
    Calibration {
        id: "rig-a-truth".into(),
        camera: Camera::from_opencv(1280, 1024, matrix, &numbers(&truth["dist"])),
        orders,
        light: LightSurfaces::Grating(grating),
        stage: Some(StageAxis::new(vector("stage")).into()),
        depth_range_mm: DepthRangeMm { near_mm: 345.0, far_mm: 455.0 },
        covariance: DMatrix::from_diagonal_element(22, 22, 1e-10),
    }
}

/// Image names and stage positions of a scan.
pub fn frames_of(folder: &std::path::Path, scan: &str) -> Vec<(PathBuf, f64)> {
    let capture = json(&folder.join("capture.json"));
    let scans = capture["scans"].as_array().unwrap();
    let scan = scans.iter().find(|entry| entry["name"] == scan).unwrap();
    let frame =
        |frame: &Value| (folder.join(frame["image"].as_str().unwrap()), frame["position_mm"].as_f64().unwrap());
    scan["frames"].as_array().unwrap().iter().map(frame).collect()
}

/// True points of the frames that have them: (order, u, v, x, y, z).
pub type TruthRow = (i8, f64, f64, [f64; 3]);

pub fn truth_rows(folder: &std::path::Path, scan: &str) -> BTreeMap<usize, Vec<TruthRow>> {
    let text = std::fs::read_to_string(folder.join(format!("truth-{scan}.csv"))).unwrap();
    let mut frames: BTreeMap<usize, Vec<TruthRow>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let f: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        frames.entry(f[0] as usize).or_default().push((f[1] as i8, f[2], f[3], [f[4], f[5], f[6]]));
    }
    frames
}

/// The true pixels of every fourth frame as unlabelled centrelines, one point per column.
pub fn truth_scan(folder: &std::path::Path, scan: &str) -> KnownScan {
    let positions = frames_of(folder, scan);
    let mut known = KnownScan { frames: Vec::new(), orders: Vec::new() };
    for (frame, rows) in truth_rows(folder, scan) {
        let mut points = Vec::new();
        for pair in rows.windows(2) {
            let (a, b) = (&pair[0], &pair[1]);
            let jump = (a.3[2] - b.3[2]).abs() > 2.0;
            if a.0 != b.0 || b.1 - a.1 > 12.0 || b.1 <= a.1 || jump {
                continue;
            }
            let mut u = a.1.ceil().max(0.0);
            while u < b.1.min(1280.0) {
                points.push((u, a.2 + (b.2 - a.2) * (u - a.1) / (b.1 - a.1), Some(a.0)));
                u += 1.0;
            }
        }
        let (found, orders) = segments(&points, LineDirection::Rows);
        let centrelines = centrelines(found, LineDirection::Rows);
        known.frames.push(ScanFrame { centrelines, position: StagePosition::LinearMm(positions[frame].1) });
        known.orders.push(orders);
    }
    known
}
