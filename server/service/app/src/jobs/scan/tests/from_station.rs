//! Scans that complete, and scans that lose frames.

use std::io::Cursor;

use scanning::files::peaks::read_peaks;
use store::ScanState;
use twin::TwinFault;

use super::bench::{Bench, from_station, run};
use crate::jobs::{JobEnd, ScanMode};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::measurements::MeasureInput;
use crate::resources::measurements::measurement;
use crate::resources::stored_scan::{stored_cloud, stored_frame, stored_peaks, stored_positions};

#[test]
fn every_row_is_in_the_scan_at_its_position_and_shown_live() {
    let bench = Bench::new();
    let job = bench.job();
    let id = bench.finish(run(from_station(-2.0, 2.0, 0.5), &job.ctx));
    let scan = bench.record(&id);
    assert_eq!((scan.state, scan.calibration_id.as_str()), (ScanState::Complete, "true0000"));
    let peaks = read_peaks(Cursor::new(bench.bytes(&scan.peaks))).unwrap();
    let positions: Vec<f64> = peaks.frames.iter().map(|frame| frame.position.value()).collect();
    assert_eq!(positions, [-2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0]);
    let times: Vec<u64> = peaks.captured_at_ns.iter().map(|time| time.unwrap()).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
    assert_eq!(scan.report["n_frames"], 9);
    assert_eq!(scan.report["losses"], serde_json::json!([]));
    assert!(scan.report["n_points"].as_u64().unwrap() > 9 * 500, "{}", scan.report);
    assert_eq!(scan.plan["n_rows"], 9);
    // The viewers saw every row as a block, and the newest frame.
    let log = bench.live.watch_points().borrow().log_of(&id).cloned().expect("the points of this scan");
    assert_eq!(log.blocks().len(), 9);
    assert_eq!(bench.bytes(scan.display.as_ref().unwrap()), log.blocks().concat());
    let shown = bench.live.watch_frames().borrow().clone().expect("a frame");
    assert_eq!((shown.frame.position_mm, shown.centrelines == peaks.frames[8].centrelines), (Some(2.0), true));
    assert!(job.said.lock().iter().any(|words| words == "row 9 of 9"));
    // Laser off, and free for the next job.
    assert_eq!(bench.operator.laser_power(), 0.0);
    assert!(!bench.folder.path().join("data/work").join(&id).exists());
}

#[test]
fn a_sweep_takes_a_frame_at_every_step() {
    let bench = Bench::new();
    let mut input = from_station(-2.0, 2.0, 0.4);
    (input.settings.mode, input.settings.speed_mm_s) = (Some(ScanMode::Continuous), Some(2.0));
    let scan = bench.scan(input);
    assert_eq!(scan.state, ScanState::Complete, "{}", scan.report);
    let peaks = read_peaks(Cursor::new(bench.bytes(&scan.peaks))).unwrap();
    let positions: Vec<f64> = peaks.frames.iter().map(|frame| frame.position.value()).collect();
    assert!((9..=12).contains(&positions.len()), "{positions:?}");
    assert!(positions.iter().all(|position_mm| (-2.0..=2.0).contains(position_mm)), "{positions:?}");
    assert!(positions.windows(2).all(|pair| (0.2..0.6).contains(&(pair[1] - pair[0]))), "{positions:?}");
}

#[test]
fn a_scan_that_lost_frames_is_invalid_and_reports_it() {
    let bench = Bench::new();
    bench.operator.set_fault(TwinFault::LostFrames { every: 4 });
    let mut input = from_station(-2.0, 2.0, 0.4);
    (input.settings.mode, input.settings.speed_mm_s) = (Some(ScanMode::Continuous), Some(2.0));
    let scan = bench.scan(input);
    assert_eq!(scan.state, ScanState::Invalid);
    let losses = scan.report["losses"].to_string();
    assert!(losses.contains("frames were lost: camera"), "{losses}");
    assert!(losses.contains("no frame between"), "{losses}");
    // A measurement on it has only this verdict.
    let asked = MeasureInput {
        tool: "sphere".into(),
        name: None,
        nominal_mm: Some(18.9),
        tolerance_mm: Some(10.0),
        region_mm: None,
        seed: None,
    };
    let document = stored_document(&bench.catalogue, &*bench.store.artifacts, Some(&scan.calibration_id));
    let document = bench.runtime.block_on(document).unwrap();
    let cloud = bench.runtime.block_on(stored_cloud(&*bench.store.artifacts, &scan)).unwrap();
    let record = measurement(&scan, &cloud, &document.calibration(), &asked).unwrap();
    assert_eq!(record.result["verdict"], "invalid");
    assert!(record.result["notes"].to_string().contains("lost"), "{}", record.result);
}

#[test]
fn a_frame_of_a_stored_scan_is_found_without_the_others_and_a_damaged_one_is_named() {
    let bench = Bench::new();
    let scan = bench.scan(from_station(-2.0, 2.0, 0.5));
    let artifacts = &*bench.store.artifacts;
    let whole = read_peaks(Cursor::new(bench.bytes(&scan.peaks))).unwrap();
    let positions = bench.runtime.block_on(stored_positions(artifacts, &scan)).unwrap();
    assert_eq!(positions, whole.frames.iter().map(|frame| frame.position).collect::<Vec<_>>());
    let frame = |idx| bench.runtime.block_on(stored_frame(artifacts, &scan, idx));
    assert_eq!(frame(5).unwrap().unwrap(), (whole.frames[5].clone(), whole.captured_at_ns[5]));
    assert_eq!(frame(9).unwrap().unwrap_err(), 9);
    let path = bench.file_of(&scan.peaks);
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[200] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let problem = frame(0).unwrap_err();
    assert!(problem.detail.contains("the peaks of scan"), "{problem:?}");
    assert!(frame(5).unwrap().is_ok(), "the other frames carry their own checksums");
    assert!(bench.runtime.block_on(stored_peaks(artifacts, &scan.peaks, &scan.id)).is_err());
}

#[test]
fn a_row_that_was_captured_twice_makes_a_scan_invalid() {
    let bench = Bench::new();
    bench.operator.set_fault(TwinFault::LostFrames { every: 4 });
    let scan = bench.scan(from_station(-2.0, 2.0, 0.5));
    assert_eq!((scan.state, scan.report["n_frames"].as_u64()), (ScanState::Invalid, Some(9)));
}

#[test]
fn a_scan_without_laser_light_fails_with_the_reason() {
    let bench = Bench::new();
    bench.operator.set_fault(TwinFault::InterlockOpen);
    let Err(JobEnd::Failed(problem)) = run(from_station(-2.0, 2.0, 0.5), &bench.job().ctx) else {
        panic!("scanned without light")
    };
    assert!(format!("{problem:?}").contains("interlock"), "{problem:?}");
    assert_eq!(bench.scans(), []);
}

#[test]
fn invalid_input_is_refused_before_anything_moves() {
    let bench = Bench::new();
    let Err(JobEnd::Failed(problem)) = run(from_station(-2.0, 200.0, 0.5), &bench.job().ctx) else {
        panic!("scanned beyond the travel")
    };
    assert_eq!(problem.pointer.as_deref(), Some("/to_mm"));
    assert_eq!(bench.operator.true_position_mm(), 0.0);
}
