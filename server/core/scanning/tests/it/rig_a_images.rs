//! The rendered scans of rig-a, from images to points, compared with the truth of every fourth frame.

use std::path::Path;

use crate::common::rig_a;
use nalgebra::Vector3;
use optics::StagePosition;
use rayon::prelude::*;
use scanning::{CloudPoint, ScanFrame, ScanParams, scan_cloud};
use serde_json::Value;
use vision::{CentrelineParams, GreyImage, Pixels, find_centrelines};

/// Fraction of the visible line columns that must be found.
const RECOVERED: f64 = 0.97;
/// Distance from the true line, px, within which a point is on it: 10 σ of a dim line, far below the line pitch.
const ON_LINE_PX: f64 = 1.5;
/// Distance from every surface, mm, beyond which a point is an outlier: 10 σ of a point.
const ASTRAY_MM: f64 = 0.4;
/// Distance from every surface that only a wrong order gives, mm: the next order is 20 mm away.
const WRONG_ORDER_MM: f64 = 3.0;
/// Accepted fraction of outliers.
const ASTRAY: f64 = 0.001;

fn image(path: &Path) -> GreyImage {
    let grey = image::open(path).unwrap().into_luma8();
    let (width, height) = (grey.width() as usize, grey.height() as usize);
    GreyImage::new(width, height, Pixels::Eight(grey.into_raw())).unwrap()
}

fn frames(folder: &Path, scan: &str) -> Vec<ScanFrame> {
    let found = rig_a::frames_of(folder, scan).into_par_iter().map(|(path, position_mm)| ScanFrame {
        centrelines: find_centrelines(&image(&path), &CentrelineParams::default()),
        position: StagePosition::LinearMm(position_mm),
    });
    found.collect()
}

/// Row of the true line at every column that lies between two close truth rows of one order.
fn true_rows(rows: &[rig_a::TruthRow]) -> Vec<(i8, i64, f64)> {
    let mut columns = Vec::new();
    for pair in rows.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let whole = a.0 == b.0 && b.1 > a.1 && b.1 - a.1 < 12.0 && (a.3[2] - b.3[2]).abs() < 2.0;
        let mut u = a.1.ceil().max(0.0);
        while whole && u < b.1.min(1280.0) {
            columns.push((a.0, u as i64, a.2 + (b.2 - a.2) * (u - a.1) / (b.1 - a.1)));
            u += 1.0;
        }
    }
    columns
}

#[test]
fn the_scans_of_rig_a_give_the_true_lines_and_no_wrong_order() {
    let Some(folder) = reference::data("rig-a") else { return };
    let calibration = rig_a::calibration(&folder);
    for scan in ["gauge", "sphere"] {
        let frames = frames(&folder, scan);
        let start = std::time::Instant::now();
        let result = scan_cloud(&frames, &calibration, &ScanParams::default()).unwrap();
        eprintln!(
            "{scan}: {} points in {:?}, {:?}",
            result.report.n_points,
            start.elapsed(),
            result.report.dropped
        );
        eprintln!("  {}", result.report.envelope);
        for pair in &result.report.self_consistency {
            eprintln!("  {pair:?}");
        }
        if let Some(folder) = std::env::var_os("KEEP") {
            keep(&Path::new(&folder).join(format!("{scan}.csv")), &result.cloud.points);
        }
        let surface = surface(&rig_a::json(&folder.join("truth.json")), scan);
        let astray = |p: &&CloudPoint| surface(Vector3::new(p.x_mm, p.y_mm, p.z_mm)) > ASTRAY_MM;
        let n_far = result
            .cloud
            .points
            .iter()
            .filter(|p| surface(Vector3::new(p.x_mm, p.y_mm, p.z_mm)) > WRONG_ORDER_MM)
            .count();
        assert_eq!(n_far, 0, "{scan}: points of a wrong order in any frame");
        let n_astray = result.cloud.points.iter().filter(astray).count();
        let (mut n_true, mut n_found, mut n_wrong) = (0, 0, 0);
        for (frame, rows) in rig_a::truth_rows(&folder, scan) {
            let points: Vec<&CloudPoint> =
                result.cloud.points.iter().filter(|p| p.frame as usize == frame).collect();
            for (order, u, v) in true_rows(&rows) {
                let on_line =
                    |p: &&&CloudPoint| p.u_px.round() as i64 == u && (f64::from(p.v_px) - v).abs() < ON_LINE_PX;
                let orders: Vec<i8> = points.iter().filter(on_line).map(|p| p.order).collect();
                n_true += 1;
                n_found += usize::from(orders.contains(&order));
                n_wrong += usize::from(orders.iter().any(|other| *other != order));
            }
        }
        let recovered = n_found as f64 / n_true as f64;
        eprintln!("  recovered {recovered:.5}, wrong {n_wrong}, astray {n_astray} of {}", result.report.n_points);
        assert_eq!(n_wrong, 0, "{scan}: points of a wrong order");
        assert!(recovered >= RECOVERED, "{scan}: {recovered} recovered");
        let share = n_astray as f64 / result.report.n_points as f64;
        assert!(share <= ASTRAY, "{scan}: {n_astray} points on no surface");
    }
}

/// Distance of a part point from the nearest surface of the scene, mm.
fn surface(truth: &Value, scan: &str) -> Box<dyn Fn(Vector3<f64>) -> f64> {
    let scene = &truth[format!("{scan}_scene").as_str()];
    let vector =
        |value: &Value| Vector3::from_vec(value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect());
    let table = vector(&scene["table_point"]);
    if scan == "sphere" {
        let (centre, normal, radius) =
            (vector(&scene["center"]), vector(&scene["normal"]), scene["radius_mm"].as_f64().unwrap());
        return Box::new(move |x| ((x - centre).norm() - radius).abs().min((x - table).dot(&normal).abs()));
    }
    // The block's axes are the columns of R, the last one its height.
    let rows: Vec<Vector3<f64>> = scene["R"].as_array().unwrap().iter().map(vector).collect();
    let half = vector(&scene["half_mm"]);
    Box::new(move |x| {
        let offset = x - table;
        let local = rows[0] * offset.x + rows[1] * offset.y + rows[2] * offset.z;
        let beside = (local.x.abs() - half.x).abs().min((local.y.abs() - half.y).abs());
        let wall = if (0.0..2.0 * half.z).contains(&local.z) { beside } else { f64::INFINITY };
        local.z.abs().min((local.z - 2.0 * half.z).abs()).min(wall)
    })
}

/// Writes the points to a file for inspection.
fn keep(path: &Path, points: &[CloudPoint]) {
    let row = |p: &CloudPoint| {
        format!("{},{},{},{},{},{},{},{}\n", p.frame, p.order, p.u_px, p.v_px, p.x_mm, p.y_mm, p.z_mm, p.sigma_mm)
    };
    std::fs::write(path, points.iter().map(row).collect::<String>()).unwrap();
}
