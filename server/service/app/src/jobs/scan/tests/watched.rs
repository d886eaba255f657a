//! Results of the watches on station scans in report, events and history; and rows with several exposures.

use std::time::Duration;

use scanning::Profile;
use store::ScanState;
use twin::{SceneKind, StationShape, TwinFault};

use super::bench::{Bench, from_station};
use crate::jobs::scan::watched::{WAITING_FRAMES, live_watch};
use crate::resources::watches::WatchHistory;

/// The result of a watch in a scan report.
fn verdict<'a>(report: &'a serde_json::Value, watch: &str) -> &'a serde_json::Value {
    let verdicts = report["watches"].as_array().unwrap();
    verdicts.iter().find(|verdict| verdict["watch"] == watch).unwrap()
}

fn kinds_of(bench: &Bench, scan_id: &str) -> Vec<String> {
    let events = bench.runtime.block_on(bench.catalogue.read().events_after(0, 1000)).unwrap().records;
    let of_scan = events.into_iter().filter(|event| event.subject == scan_id && event.kind == "watch.warned");
    of_scan.map(|event| event.body["watch"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_wavelength_drift_is_in_the_report_the_events_and_the_history() {
    let bench = Bench::new();
    bench.operator.place_part(&SceneKind::Freeform);
    let clean = bench.scan(from_station(-20.0, 20.0, 0.5));
    assert_eq!(clean.state, ScanState::Complete, "{}", clean.report["watches"]);
    assert_eq!(verdict(&clean.report, "wavelength")["state"], "quiet", "{}", clean.report["watches"]);
    assert_eq!(kinds_of(&bench, &clean.id), [""; 0]);

    bench.operator.set_fault(TwinFault::WavelengthDrift { relative: 3e-3 });
    let warm = bench.scan(from_station(-20.0, 20.0, 0.5));
    let wavelength = verdict(&warm.report, "wavelength");
    assert!(["warning", "invalid"].contains(&wavelength["state"].as_str().unwrap()), "{wavelength}");
    assert!((wavelength["value"].as_f64().unwrap() - 3e-3).abs() < 1e-3, "{wavelength}");
    let is_invalid = wavelength["state"] == "invalid";
    assert_eq!(warm.state == ScanState::Invalid, is_invalid, "{}", warm.report["watches"]);
    assert!(kinds_of(&bench, &warm.id).contains(&"wavelength".to_owned()));
    let history = bench.runtime.block_on(WatchHistory::read(&bench.catalogue)).unwrap();
    let scans: Vec<&str> = history.readings.iter().map(|reading| reading.scan_id.as_str()).collect();
    assert_eq!(scans, [clean.id.as_str(), warm.id.as_str()]);
    assert_eq!(history.readings[1].verdicts, warm.report["watches"]);
    assert_eq!(history.n_reference_scans("true0000"), 2);
}

#[test]
fn lost_steps_are_reported_while_the_scan_runs_and_at_its_end() {
    // With all pixels: with a quarter of them, nothing can be said about the steps of this part.
    let bench = Bench::of(&StationShape::default());
    bench.operator.place_part(&SceneKind::Freeform);
    let (station, operator) = (bench.station.clone(), bench.operator.clone());
    let reaches = move |place: fn(f64) -> bool| {
        while !station.status().position_mm.is_some_and(place) {
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    let loses = std::thread::spawn(move || {
        reaches(|position_mm| position_mm < -20.0);
        // From here on several orders see what others have seen.
        reaches(|position_mm| position_mm > 12.5);
        operator.set_fault(TwinFault::LostSteps { lost_mm: 0.5 });
    });
    let scan = bench.scan(from_station(-27.5, 27.5, 0.5));
    loses.join().unwrap();
    let found = verdict(&scan.report, "lost_steps");
    assert_eq!(found["reason_code"], "steps_lost", "{found}");
    // One from the live watch, one with the results of the whole scan.
    let n_warned = kinds_of(&bench, &scan.id).iter().filter(|kind| *kind == "lost_steps").count();
    assert_eq!(n_warned, 2);
}

#[test]
fn a_live_watch_that_cannot_follow_ends_and_delays_no_frame() {
    let bench = Bench::new();
    let (mut frames, watch) = live_watch(&bench.document.calibration()).unwrap();
    // Nobody looks at them: the last one is not waited for.
    for idx in 0..=WAITING_FRAMES {
        frames.add("scan", &Profile::default(), 0.1 * idx as f64);
    }
    // It looks at those that waited and awaits no more, although the scan goes on.
    watch.run(&bench.job().ctx, "scan");
    frames.add("scan", &Profile::default(), 0.0);
}

#[test]
fn rows_of_two_exposures_replace_saturated_points_and_restore_the_camera_settings() {
    let bench = Bench::new();
    let before_us = bench.station.status().camera_settings.exposure_us;
    let mut input = from_station(-2.0, 2.0, 0.5);
    input.settings.exposures_us = vec![8000.0, 1000.0];
    let scan = bench.scan(input);
    assert_eq!(scan.state, ScanState::Complete, "{}", scan.report);
    assert_eq!(scan.report["n_frames"], 9);
    let exposures = &scan.report["exposures"];
    assert_eq!(exposures["exposures_us"], serde_json::json!([1000.0, 8000.0]));
    let [n_points, n_replaced] = ["n_points", "n_replaced"].map(|key| exposures[key].as_u64().unwrap());
    // 8 ms is eight times what just fits on grey paint.
    assert!(2 * n_replaced > n_points, "{exposures}");
    assert_eq!(bench.station.status().camera_settings.exposure_us, before_us);
    let single = bench.scan(from_station(-2.0, 2.0, 0.5));
    let [fused, alone] = [&scan, &single].map(|scan| scan.report["n_points"].as_u64().unwrap());
    assert!(20 * fused >= 19 * alone, "{fused} points, {alone} from one exposure");
}
