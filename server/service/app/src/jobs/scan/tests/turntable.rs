//! Scans on a turntable: planned and stored in degrees, registered about the axis, with their closure.
//!
//! The true parameters of the station are the calibration, so that errors are those of the scan. Not tested here: a
//! calibrated axis (`jobs::tests::calibrating`), a wobbling table.

use std::io::Cursor;

use optics::{StageKind, StagePosition};
use scanning::files::peaks::read_peaks;
use serde_json::json;
use store::{MeasurementFilter, Page, ScanRecord, ScanState};
use twin::StationShape;

use super::bench::{Bench, from_station, resumed, run, shape};
use crate::jobs::{JobEnd, ScanInput, ScanMode, ScanSource};
use crate::resources::measurements::MeasureInput;
use crate::resources::scan_run::{ScanRun, ScanSettings};

/// Tolerance for points of a sphere at most 30 mm off the axis, rows 7.5° apart: noise of 0.05 px and the row spacing.
const CLOSURE_RMS_MM: f64 = 0.1;

fn bench() -> Bench {
    Bench::of(&StationShape { stage: StageKind::Rotary, ..shape() })
}

fn turn(from_deg: f64, to_deg: f64, step_deg: f64) -> ScanInput {
    ScanInput {
        settings: ScanSettings {
            from_deg: Some(from_deg),
            to_deg: Some(to_deg),
            step_deg: Some(step_deg),
            ..ScanSettings::default()
        },
        ..from_station(0.0, 0.0, 1.0)
    }
}

fn positions(bench: &Bench, scan: &ScanRecord) -> Vec<StagePosition> {
    read_peaks(Cursor::new(bench.bytes(&scan.peaks))).unwrap().frames.iter().map(|frame| frame.position).collect()
}

#[test]
fn a_sphere_is_scanned_over_a_full_turn_measured_and_rescanned_from_its_images() {
    let bench = bench();
    let ball = MeasureInput {
        tool: "sphere".into(),
        name: None,
        nominal_mm: Some(18.9),
        tolerance_mm: None,
        region_mm: None,
        seed: None,
    };
    let mut whole = ScanInput { name: Some("ball".into()), measure: vec![ball], ..turn(0.0, 375.0, 7.5) };
    whole.settings.keep_frames = true;
    let scan = bench.scan(whole);
    assert_eq!(scan.state, ScanState::Complete, "{}", scan.report);
    assert_eq!(positions(&bench, &scan)[50], StagePosition::RotaryDeg(375.0));
    assert_eq!((scan.plan["to_deg"].as_f64(), scan.plan["to_mm"].as_f64()), (Some(375.0), None));
    for gap in ["same_line", "other_lines"] {
        let rms_mm = scan.report["closure"][gap]["rms_mm"].as_f64();
        println!("closure, {gap}: {rms_mm:?} mm of {}", scan.report["closure"][gap]["n_pairs"]);
        assert!(rms_mm.is_some_and(|rms_mm| rms_mm < CLOSURE_RMS_MM), "{gap}: {}", scan.report["closure"]);
    }
    let filter = MeasurementFilter { scan_id: Some(scan.id.clone()), ..MeasurementFilter::default() };
    let page = Page { before: None, limit: 1 };
    let measured = bench.runtime.block_on(bench.catalogue.read().measurements(&filter, &page)).unwrap().records;
    let result = &measured[0].result;
    let [radius_mm, u_mm] = ["value", "expanded_uncertainty"].map(|key| result[key].as_f64().unwrap());
    println!("radius {radius_mm:.4} ± {u_mm:.4} mm");
    // Most of both is the thickness of the lines, 0.6 mm at these pixels.
    assert!((radius_mm - 18.9).abs() < u_mm && u_mm < 0.1, "{result}");
    let source = ScanSource::Capture { capture_id: scan.capture_id.clone().unwrap(), scan: None };
    let again = bench.scan(ScanInput { source, settings: ScanSettings::default(), ..turn(0.0, 0.0, 1.0) });
    assert_eq!(bench.cloud(&again), bench.cloud(&scan));
}

#[test]
fn a_continuous_turntable_scan_has_constant_speed_and_a_stopped_one_is_resumed() {
    let bench = bench();
    // Rows close enough that orders see the same surfaces even if a busy machine varies their spacing.
    let mut sweep = turn(0.0, 60.0, 3.0);
    (sweep.settings.mode, sweep.settings.speed_deg_s) = (Some(ScanMode::Continuous), Some(30.0));
    let swept = bench.scan(sweep);
    assert_eq!(swept.state, ScanState::Complete, "{}", swept.report);
    let angles: Vec<f64> = positions(&bench, &swept).iter().map(|at| at.deg().unwrap()).collect();
    assert!(angles.windows(2).all(|pair| (1.5..4.5).contains(&(pair[1] - pair[0]))), "{angles:?}");

    let job = bench.job_cancelled_at(|words| words == "row 4 of 11");
    assert!(matches!(run(turn(0.0, 30.0, 3.0), &job.ctx), Err(JobEnd::Cancelled)));
    let partial = bench.scans().into_iter().find(|scan| scan.state == ScanState::Partial).unwrap();
    let whole = bench.scan(resumed(&partial.id));
    assert_eq!(whole.state, ScanState::Complete);
    assert_eq!(positions(&bench, &whole).len(), 11);
    assert_eq!(ScanRun::of(&whole).unwrap().plan.unwrap().range.stage, StageKind::Rotary);
    assert_eq!(bench.cloud(&whole), bench.cloud(&bench.scan(turn(0.0, 30.0, 3.0))));
}

#[test]
fn live_points_of_a_turntable_scan_are_registered_about_the_axis() {
    let bench = bench();
    let scan = bench.scan(turn(0.0, 30.0, 3.0));
    let shown = bench.bytes(scan.display.as_ref().unwrap());
    // Bytes 24–31 of a block: the angle.
    let angle = |at: usize| f64::from_le_bytes(shown[at + 24..at + 32].try_into().unwrap());
    let second = live::protocol::points::block_length(&shown).unwrap();
    // A frame without points has no block.
    let steps = angle(second) / 3.0;
    assert!(angle(0) == 0.0 && steps.fract() == 0.0 && (1.0..=10.0).contains(&steps), "{}", angle(second));
    assert_eq!(scan.plan["step_deg"], json!(3.0));
}
