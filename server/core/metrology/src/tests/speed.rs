//! Computing time for a million points, measured on a quiet machine; not asserted.
//! `cargo test --release -p sheaf-metrology --lib speed -- --ignored --nocapture --test-threads 1`

use std::time::Instant;

use nalgebra::{Rotation3, Vector3};
use optics::Rigid;

use super::cad::{Freeform, nominal_mesh};
use super::plan::{TestPart, characteristics, test_plan};
use super::shaped_scan::{ShapedScan, part_from_datum, shaped_scan};
use crate::*;

/// 1.1 million points.
const MILLION: ShapedScan =
    ShapedScan { n_frames: 400, step_mm: 0.08, pitch_mm: 0.062, half_width_mm: 28.0, ..ShapedScan::FINE };

fn shortest_s(mut work: impl FnMut()) -> f64 {
    let timed = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..5).map(timed).fold(f64::INFINITY, f64::min)
}

#[test]
#[ignore = "a measurement of speed: release build, quiet machine"]
fn speed_of_ten_characteristics_on_a_million_points() {
    let pose = part_from_datum(1);
    let (cloud, calibration) = shaped_scan(&TestPart, &pose, 1, &MILLION);
    let ten: Vec<_> = characteristics().into_iter().take(10).collect();
    let plan = test_plan(&pose, &ten);
    let seconds = shortest_s(|| {
        assert_eq!(evaluate(&plan, &cloud, Some(&calibration), &Models::new()).unwrap().characteristics.len(), 10)
    });
    eprintln!("{} characteristics on {} points: {seconds:.3} s", ten.len(), cloud.points.len());
}

#[test]
#[ignore = "a measurement of speed: release build, quiet machine"]
fn speed_of_a_comparison_of_a_million_points_with_two_hundred_thousand_triangles() {
    let pose = part_from_datum(1);
    let (cloud, calibration) = shaped_scan(&Freeform { dent_mm: 0.0 }, &pose, 1, &MILLION);
    let mesh = nominal_mesh(317);
    let start = Instant::now();
    let nominal = Nominal::new(&mesh).unwrap();
    eprintln!("tree of {} triangles: {:.3} s", mesh.triangles.len(), start.elapsed().as_secs_f64());
    let off = Rigid::new(Rotation3::new(Vector3::new(0.01, -0.01, 0.01)), Vector3::new(0.4, 0.3, -0.3));
    let align = AlignTo::Surface { start: off * pose.inverse() };
    let request = CompareRequest {
        align,
        tolerance_mm: Some(0.1),
        reach_mm: None,
        capture_mm: None,
        region: None,
        surface_region: None,
    };
    let seconds = shortest_s(|| {
        compare(&cloud, Some(&calibration), &nominal, &request).unwrap();
    });
    eprintln!("{} points to {} triangles: {seconds:.3} s", cloud.points.len(), mesh.triangles.len());
}
