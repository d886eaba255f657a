//! The rendered station: noise-free truth points must give the nominal values.

use std::path::PathBuf;

use nalgebra::Vector3;
use scanning::{Cloud, CloudPoint};
use serde_json::Value;

use crate::*;

/// Truth coordinates are rounded to 1e-5 mm; a tenth of the required micrometre is left for the fit.
const TOLERANCE_MM: f64 = 1e-3;

fn json(path: PathBuf) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The truth table of a scan as a cloud: X_part = X_camera − s·t.
fn truth_cloud(folder: &std::path::Path, scan: &str) -> Cloud {
    let truth = json(folder.join("truth.json"));
    let stage: Vec<f64> = truth["stage"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let stage = Vector3::from_column_slice(&stage);
    let capture = json(folder.join("capture.json"));
    let scans = capture["scans"].as_array().unwrap();
    let frames = scans.iter().find(|s| s["name"] == scan).unwrap()["frames"].as_array().unwrap();
    let table = std::fs::read_to_string(folder.join(format!("truth-{scan}.csv"))).unwrap();
    let points = table
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            let frame = cells[0] as usize;
            let position_mm = frames[frame]["position_mm"].as_f64().unwrap();
            let part = Vector3::new(cells[4], cells[5], cells[6]) - stage * position_mm;
            CloudPoint {
                x_mm: part.x,
                y_mm: part.y,
                z_mm: part.z,
                order: cells[1] as i8,
                frame: frame as u32,
                u_px: cells[2] as f32,
                v_px: cells[3] as f32,
                intensity: 100.0,
                sigma_mm: 0.03,
            }
        })
        .collect();
    Cloud { points, comments: Vec::new() }
}

#[test]
fn the_gauge_block_of_the_rendered_station_is_8_9_mm_high() {
    let Some(folder) = reference::data("rig-a") else { return };
    for nominal_mm in [None, Some(8.9)] {
        let request = MeasureRequest { nominal_mm, ..MeasureRequest::new(Tool::Step) };
        let step = measure(&truth_cloud(&folder, "gauge"), None, &request).unwrap();
        eprintln!("gauge {:.6} mm, {:?}", step.value, step.features);
        assert!((step.value - 8.9).abs() < TOLERANCE_MM, "{}", step.value);
    }
}

#[test]
fn the_sphere_of_the_rendered_station_has_a_radius_of_18_9_mm() {
    let Some(folder) = reference::data("rig-a") else { return };
    for nominal_mm in [None, Some(18.9)] {
        let request = MeasureRequest { nominal_mm, ..MeasureRequest::new(Tool::Sphere) };
        let sphere = measure(&truth_cloud(&folder, "sphere"), None, &request).unwrap();
        eprintln!("sphere {:.6} mm, {:?}", sphere.value, sphere.features);
        assert!((sphere.value - 18.9).abs() < TOLERANCE_MM, "{}", sphere.value);
    }
}
