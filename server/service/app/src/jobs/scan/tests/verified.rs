//! A known part is scanned and compared; what was on the stage comes back.

use crate::error::ErrorKind;
use store::ScanState;
use twin::Scene;

use super::bench::{Bench, from_station, verify};
use crate::jobs::{JobEnd, ScanInput, VerifyInput};

/// Largest error of a height with the true calibration: noise of thousands of points, and the lines' thickness at
/// half the default station's resolution.
const WITHIN_MM: f64 = 0.02;

fn gauge(tolerance_mm: f64) -> VerifyInput {
    let scan = ScanInput { from_mm: None, to_mm: None, step_mm: None, ..from_station(0.0, 0.0, 1.0) };
    VerifyInput { artefact: "gauge".into(), nominal_mm: 8.9, tolerance_mm: Some(tolerance_mm), scan }
}

#[test]
fn a_gauge_is_verified_and_the_ball_comes_back() {
    let bench = Bench::new();
    let job = bench.job();
    let done = verify(gauge(0.2), &job.ctx).unwrap_or_else(|end| panic!("{end:?}"));
    let message = done.message.clone();
    let id = bench.finish(Ok(done));
    let (scan_id, measurement_id) = id.split_once('/').unwrap();
    let scan = bench.record(scan_id);
    assert_eq!((scan.state, scan.name.as_str()), (ScanState::Complete, "gauge"));
    let record = bench.runtime.block_on(bench.ledger.read().measurement(measurement_id)).unwrap();
    assert_eq!((record.scan_id.as_str(), &record.result["tool"]), (scan_id, &serde_json::json!("step")));
    let value = record.result["value"].as_f64().unwrap();
    assert!((value - 8.9).abs() < WITHIN_MM, "{value}");
    assert_eq!(record.result["verdict"], "ok", "{}", record.result);
    assert!(
        message.starts_with("gauge: nominal 8.9000 mm, measured 8.") && message.ends_with(", OK"),
        "{message}"
    );
    assert!(matches!(*bench.operator.scene(), Scene::Sphere(_)), "the ball is back");
}

#[test]
fn the_true_size_is_the_parts_own_and_not_what_a_person_types() {
    let bench = Bench::new();
    let typed = VerifyInput { nominal_mm: 9.5, ..gauge(0.2) };
    let id = bench.finish(verify(typed, &bench.job().ctx));
    let record = bench.runtime.block_on(bench.ledger.read().measurement(id.split_once('/').unwrap().1)).unwrap();
    let value = record.result["value"].as_f64().unwrap();
    assert!((value - 8.9).abs() < WITHIN_MM, "{value}");
    assert_eq!(record.result["verdict"], "not_ok", "{}", record.result);
}

#[test]
fn a_cancelled_verification_puts_the_ball_back_too() {
    let bench = Bench::new();
    let job = bench.job_cancelled_at(|words| words.starts_with("row 2 of"));
    assert!(matches!(verify(gauge(0.2), &job.ctx), Err(JobEnd::Cancelled)));
    assert!(matches!(*bench.operator.scene(), Scene::Sphere(_)), "the ball is back");
}

#[test]
fn an_unknown_part_is_refused() {
    let bench = Bench::new();
    let mut input = gauge(0.2);
    input.artefact = "cube".into();
    let Err(JobEnd::Failed(problem)) = verify(input, &bench.job().ctx) else { panic!("verified a cube") };
    assert_eq!((problem.kind, problem.pointer.as_deref()), (ErrorKind::Impossible, Some("/artefact")));
}
