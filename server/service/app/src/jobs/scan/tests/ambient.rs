//! Ambient light during a scan: laser-off images are captured, subtracted, stored and counted.

use twin::{Scene, StationShape};

use super::bench::{Bench, from_station, shape};
use crate::jobs::{ScanInput, ScanMode, ScanSource};
use crate::resources::scan_run::{BackgroundInput, ScanSettings};
use store::{ScanRecord, ScanState};

/// Levels of white in laser frames: a bright hall.
const BRIGHT: f64 = 60.0;

/// A board on the stage: its edges resemble lines in a bright room.
fn bench(ambient_levels: f64) -> Bench {
    let bench = Bench::of(&StationShape { ambient_levels, ..shape() });
    let board = twin::poses::stage_board(&bench.operator.model(), &[-3.0, 3.0]);
    bench.operator.place(Scene::Board(board));
    bench
}

fn with(background: BackgroundInput) -> ScanInput {
    let mut input = from_station(-2.0, 2.0, 1.0);
    input.settings.background = Some(background);
    input
}

fn figures(scan: &ScanRecord) -> [u64; 3] {
    ["n_images", "n_frames_with", "n_frames_without"].map(|key| scan.report["background"][key].as_u64().unwrap())
}

#[test]
fn ambient_light_is_subtracted_and_the_kept_images_give_the_same_cloud() {
    let [dark, bright] = [0.0, BRIGHT].map(bench);
    let n_points = |scan: &ScanRecord| scan.report["n_points"].as_u64().unwrap() as f64;
    let in_the_dark = n_points(&dark.scan(from_station(-2.0, 2.0, 1.0)));
    let as_it_is = n_points(&bright.scan(from_station(-2.0, 2.0, 1.0)));
    let every_other = BackgroundInput { every_rows: Some(2), above_levels: None };
    let mut kept = with(every_other);
    kept.settings.keep_frames = true;
    let scan = bright.scan(kept);
    println!(
        "{in_the_dark} points in the dark, {as_it_is} in a bright room, {} after subtraction",
        n_points(&scan)
    );
    assert_eq!(scan.state, ScanState::Complete, "{}", scan.report);
    // The image of the previous row shows the board elsewhere: every row has its own.
    assert_eq!(figures(&scan), [5, 5, 0]);
    let levels = scan.report["background"]["ambient_levels"].as_f64().unwrap();
    assert!((0.6 * BRIGHT..1.2 * BRIGHT).contains(&levels), "{levels}");
    let off = |n: f64| (n / in_the_dark - 1.0).abs();
    assert!(off(n_points(&scan)) < 0.05 && off(n_points(&scan)) < off(as_it_is), "{}", scan.report);
    let source = ScanSource::Capture { capture_id: scan.capture_id.clone().unwrap(), scan: None };
    let again =
        bright.scan(ScanInput { source, settings: ScanSettings::default(), ..from_station(0.0, 0.0, 1.0) });
    assert_eq!(bright.cloud(&again), bright.cloud(&scan));
    assert_eq!(bright.operator.laser_power(), 0.0);
}

#[test]
fn a_dark_room_is_checked_once_and_nothing_is_subtracted() {
    let bench = Bench::new();
    let plain = bench.scan(from_station(-2.0, 2.0, 1.0));
    let above = BackgroundInput { every_rows: None, above_levels: Some(40.0) };
    let scan = bench.scan(with(above));
    assert_eq!(figures(&scan), [1, 0, 5]);
    assert_eq!(bench.cloud(&scan), bench.cloud(&plain));
    assert_eq!(plain.report.get("background"), None);
}

#[test]
fn a_continuous_scan_has_laser_off_images_before_and_after() {
    let bench = Bench::of(&StationShape { ambient_levels: BRIGHT, ..shape() });
    let mut sweep = with(BackgroundInput::default());
    sweep.settings = ScanSettings {
        mode: Some(ScanMode::Continuous),
        speed_mm_s: Some(2.0),
        step_mm: Some(0.4),
        ..sweep.settings
    };
    let scan = bench.scan(sweep);
    let [n_images, n_with, n_without] = figures(&scan);
    assert_eq!((scan.state, n_images), (ScanState::Complete, 2), "{}", scan.report);
    assert_eq!(n_with + n_without, scan.report["n_frames"].as_u64().unwrap());
    assert!(n_with > 0, "{}", scan.report);
}
