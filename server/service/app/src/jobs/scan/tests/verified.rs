//! A reference part is scanned and compared; the previous scene is restored.

use crate::error::ErrorKind;
use store::ScanState;
use twin::Scene;

use super::bench::{Bench, from_station, verify};
use crate::jobs::{JobEnd, ScanInput, VerifyInput};
use crate::resources::scan_run::ScanSettings;

/// Maximum error of a height with the true calibration: noise of thousands of points, and the line thickness at half the
/// resolution of the default station.
const WITHIN_MM: f64 = 0.02;

fn gauge(tolerance_mm: f64) -> VerifyInput {
    let scan = ScanInput { settings: ScanSettings::default(), ..from_station(0.0, 0.0, 1.0) };
    VerifyInput { reference_part: "gauge".into(), nominal_mm: 8.9, tolerance_mm: Some(tolerance_mm), scan }
}

#[test]
fn a_gauge_is_verified_and_the_sphere_is_restored() {
    let bench = Bench::new();
    let job = bench.job();
    let done = verify(gauge(0.2), &job.ctx).unwrap_or_else(|end| panic!("{end:?}"));
    let message = done.message.clone();
    let id = bench.finish(Ok(done));
    let (scan_id, measurement_id) = id.split_once('/').unwrap();
    let scan = bench.record(scan_id);
    assert_eq!((scan.state, scan.name.as_str()), (ScanState::Complete, "gauge"));
    let record = bench.runtime.block_on(bench.catalogue.read().measurement(measurement_id)).unwrap();
    assert_eq!((record.scan_id.as_str(), &record.result["tool"]), (scan_id, &serde_json::json!("step")));
    let value = record.result["value"].as_f64().unwrap();
    assert!((value - 8.9).abs() < WITHIN_MM, "{value}");
    assert_eq!(record.result["verdict"], "ok", "{}", record.result);
    assert!(
        message.starts_with("gauge: nominal 8.9000 mm, measured 8.") && message.ends_with(", OK"),
        "{message}"
    );
    assert!(matches!(*bench.operator.scene(), Scene::Sphere(_)), "the sphere is restored");
}

#[test]
fn the_simulated_part_has_its_true_size_regardless_of_the_nominal() {
    let bench = Bench::new();
    let typed = VerifyInput { nominal_mm: 9.5, ..gauge(0.2) };
    let id = bench.finish(verify(typed, &bench.job().ctx));
    let record =
        bench.runtime.block_on(bench.catalogue.read().measurement(id.split_once('/').unwrap().1)).unwrap();
    let value = record.result["value"].as_f64().unwrap();
    assert!((value - 8.9).abs() < WITHIN_MM, "{value}");
    assert_eq!(record.result["verdict"], "not_ok", "{}", record.result);
}

#[test]
fn a_cancelled_verification_restores_the_sphere() {
    let bench = Bench::new();
    let job = bench.job_cancelled_at(|words| words.starts_with("row 2 of"));
    assert!(matches!(verify(gauge(0.2), &job.ctx), Err(JobEnd::Cancelled)));
    assert!(matches!(*bench.operator.scene(), Scene::Sphere(_)), "the sphere is restored");
}

#[test]
fn an_unknown_part_is_refused() {
    let bench = Bench::new();
    let mut input = gauge(0.2);
    input.reference_part = "cube".into();
    let Err(JobEnd::Failed(problem)) = verify(input, &bench.job().ctx) else { panic!("verified a cube") };
    assert_eq!((problem.kind, problem.pointer.as_deref()), (ErrorKind::Impossible, Some("/reference_part")));
}
