//! The doctor on the simulated station: a faultless station passes, and each fault fails its own checks.
//!
//! Not shown here: that the limits suit real cameras.

mod faulty_camera;

use std::sync::Arc;
use std::sync::mpsc::channel;

use nalgebra::{Matrix3, Vector3};
use pipeline::{Reporter, Task};
use station::{StationDevices, StationHandle};
use twin::poses::BOARD_CORNERS;
use twin::{
    Board, Scene, SceneKind, StationModel, StationShape, TwinControl, TwinDriver, TwinFault, TwinOptions,
    TwinStation,
};

use super::limits::SCALE_PERCENT;
use super::*;
use faulty_camera::{CameraFaults, FaultyCameraDriver};

/// Frame rate, Hz; small images are rendered faster than that.
const RATE_HZ: f64 = 60.0;

struct Bench {
    station: StationHandle,
    control: TwinControl,
    runtime: tokio::runtime::Runtime,
    settings: ExaminationSettings,
    cancel: CancelFlag,
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.station.shut_down();
    }
}

/// A small simulated station with a plate, and a camera with these faults.
fn bench(faults: CameraFaults) -> Bench {
    bench_of((320, 256), faults)
}

fn bench_of((width_px, height_px): (usize, usize), faults: CameraFaults) -> Bench {
    let shape = StationShape { width_px, height_px, ..StationShape::default() };
    let options = TwinOptions { scene: SceneKind::Plate, ..TwinOptions::default() };
    let world = TwinStation::new(StationModel::seeded(7, &shape).unwrap(), options);
    let control = world.control();
    let twin = Arc::new(TwinDriver::over(world));
    let camera = Arc::new(FaultyCameraDriver { twin: twin.clone(), faults });
    let devices = StationDevices { camera, stage: twin.clone(), laser: twin.clone(), twin: Some(twin) };
    let station = StationHandle::start(&devices, false);
    let settings = ExaminationSettings {
        exposure_us: Some(700.0),
        gain_db: None,
        frame_rate_hz: Some(RATE_HZ),
        power: 1.0,
        board: chessboard(12.0),
        lines_along_rows: true,
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
    Bench { station, control, runtime, settings, cancel: CancelFlag::default() }
}

fn chessboard(square_mm: f64) -> capture::Target {
    let (inner_columns, inner_rows) = BOARD_CORNERS;
    capture::Target::Chessboard(capture::ChessboardTarget {
        inner_columns,
        inner_rows,
        square_mm: square_mm.into(),
    })
}

/// Calls a function with each note.
struct Notes(Box<dyn Fn(&str) + Send + Sync>);

impl Reporter for Notes {
    fn note(&self, text: &str) {
        (self.0)(text);
    }
    fn warn(&self, _text: &str) {}
    fn is_cancelled(&self) -> bool {
        false
    }
    fn count(&self, _title: &str, _unit: &str, _total: usize) -> Box<dyn Task> {
        unreachable!("the doctor counts nothing")
    }
    fn fraction(&self, _title: &str) -> Box<dyn Task> {
        unreachable!("the doctor has no fractions")
    }
}

impl Bench {
    fn examine_with(&self, note: impl Fn(&str) + Send + Sync + 'static) -> Result<Vec<Check>, Cancelled> {
        let examination = Examination {
            station: &self.station,
            settings: &self.settings,
            cancel: &self.cancel,
            reporter: &Notes(Box::new(note)),
            runtime: self.runtime.handle().clone(),
        };
        examine(&examination, || true)
    }

    fn examine(&self) -> Vec<Check> {
        self.examine_with(|_| {}).unwrap_or_else(|Cancelled| panic!("nobody cancelled"))
    }
}

/// Names of the failed checks.
fn failed(checks: &[Check]) -> Vec<&'static str> {
    checks.iter().filter(|check| check.outcome == Outcome::NotOk).map(|check| check.name).collect()
}

fn of<'c>(checks: &'c [Check], name: &str) -> &'c Check {
    checks
        .iter()
        .find(|check| check.name == name)
        .unwrap_or_else(|| panic!("no {name} in\n{}", check::table(checks)))
}

/// Every check, in the order of the table.
const ALL: [&str; 18] = [
    "camera",
    "stage",
    "laser",
    "laser off at the start",
    "frame rate",
    "timestamp jitter",
    "frames lost",
    "dark noise",
    "ambient light",
    "sensor defects",
    "laser lines",
    "line width",
    "line saturation",
    "exposure linearity",
    "laser off on command",
    "laser off without frames",
    "stage position",
    "stage scale",
];

#[test]
fn a_faultless_station_passes_every_check() {
    let bench = bench(CameraFaults::default());
    let checks = bench.examine();
    let names: Vec<&str> = checks.iter().map(|check| check.name).collect();
    assert_eq!(names, ALL);
    // Rate, jitter and losses depend on the load of this machine; they have tests of their own.
    let failed: Vec<_> = failed(&checks).into_iter().filter(|name| !LOAD_DEPENDENT.contains(name)).collect();
    assert!(failed.is_empty(), "{}", check::table(&checks));
    assert_eq!(of(&checks, "stage scale").outcome, Outcome::NotRun, "there is no board");
    assert_eq!(bench.control.laser_power(), 0.0);
}

/// Checks that may fail on a loaded machine without a fault of the station.
const LOAD_DEPENDENT: [&str; 3] = ["frame rate", "timestamp jitter", "frames lost"];

/// Examines a station with a fault; the failed checks except the load-dependent ones.
fn failed_with(bench: &Bench) -> (Vec<&'static str>, Vec<Check>) {
    let checks = bench.examine();
    let failed = failed(&checks).into_iter().filter(|name| !LOAD_DEPENDENT.contains(name)).collect();
    (failed, checks)
}

#[test]
fn lost_frames_are_counted_by_reason() {
    let bench = bench(CameraFaults::default());
    bench.control.set_fault(TwinFault::LostFrames { every: 10 });
    let lost = of(&bench.examine(), "frames lost").clone();
    assert_eq!(lost.outcome, Outcome::NotOk);
    // Every tenth of 120 frames.
    assert!(lost.value.unwrap() >= 11.0 && lost.figure.contains("camera"), "{lost:?}");
    assert!(!lost.remedy.is_empty());
}

#[test]
fn scattered_time_stamps_fail_the_jitter_check() {
    let mut bench = bench(CameraFaults { jitter_ms: 8.0, ..CameraFaults::default() });
    bench.settings.frame_rate_hz = Some(20.0);
    let jitter = of(&bench.examine(), "timestamp jitter").clone();
    // Every other frame 8 ms early: ±4 ms about a steady rate, and what the machine adds.
    assert!(jitter.outcome == Outcome::NotOk && jitter.value.unwrap() > 3900.0, "{jitter:?}");
}

#[test]
fn a_gamma_curve_fails_only_the_linearity_check() {
    let bench = bench(CameraFaults { gamma: 2.2, ..CameraFaults::default() });
    let (failed, checks) = failed_with(&bench);
    assert_eq!(failed, ["exposure linearity"], "{}", check::table(&checks));
}

#[test]
fn too_long_an_exposure_fails_only_the_saturation_check() {
    let mut bench = bench(CameraFaults::default());
    bench.settings.exposure_us = Some(5000.0);
    let (failed, checks) = failed_with(&bench);
    assert_eq!(failed, ["line saturation"], "{}", check::table(&checks));
}

#[test]
fn high_gain_fails_the_noise_check() {
    let mut bench = bench(CameraFaults::default());
    (bench.settings.exposure_us, bench.settings.gain_db) = (Some(40.0), Some(24.0));
    let (failed, checks) = failed_with(&bench);
    assert!(failed.contains(&"dark noise"), "{}", check::table(&checks));
}

/// Most good pixels of a dark frame that noise makes hot: 0.3 of 81,920 on average, and five once in 40,000 dark frames.
/// Which frames are averaged depends on the load of this machine.
const GOOD_PIXELS_REPORTED: f64 = 4.0;

#[test]
fn sensor_defects_are_counted_with_the_lens_covered() {
    let bench = bench(CameraFaults::default());
    let defects = || {
        let checks = bench.examine();
        of(&checks, "sensor defects").clone()
    };
    bench.control.set_fault(TwinFault::LensCovered);
    let good = defects();
    assert!(good.outcome == Outcome::Ok && good.value.unwrap() <= GOOD_PIXELS_REPORTED, "{good:?}");
    bench.control.set_fault(TwinFault::SensorDefects { levels: 6.0 });
    let bad = defects();
    // One pixel in two thousand of 320 × 256, some of them drawn twice.
    let expected = 37.0..=40.0 + GOOD_PIXELS_REPORTED;
    assert!(bad.outcome == Outcome::NotOk && expected.contains(&bad.value.unwrap()), "{bad:?}");
}

#[test]
fn a_laser_that_stays_on_fails_and_prevents_motion() {
    let bench = bench(CameraFaults::default());
    bench.control.follow_laser(|_| 1.0);
    let checks = bench.examine();
    let light = of(&checks, "light");
    assert!(light.outcome == Outcome::NotOk && light.figure.contains("although it was switched off"), "{light:?}");
    assert_eq!(of(&checks, "stage position").outcome, Outcome::NotRun);
}

#[test]
fn a_laser_that_is_only_reported_off_is_detected_in_the_image() {
    // Dark after each of three exposures, lit after the fourth switch-off.
    let bench = bench(CameraFaults { lit_from_switch_off: 4, ..CameraFaults::default() });
    let (failed, checks) = failed_with(&bench);
    assert_eq!(failed, ["laser off on command"], "{}", check::table(&checks));
}

#[test]
fn a_laser_that_does_not_turn_on_fails() {
    let bench = bench(CameraFaults::default());
    bench.control.follow_laser(|_| 0.0);
    let (failed, checks) = failed_with(&bench);
    assert_eq!(failed, ["light"], "{}", check::table(&checks));
}

#[test]
fn light_too_faint_for_lines_fails_the_line_check() {
    let mut bench = bench(CameraFaults::default());
    bench.settings.power = 0.02;
    let (failed, checks) = failed_with(&bench);
    assert_eq!(failed, ["laser lines"], "{}", check::table(&checks));
    assert_eq!(of(&checks, "exposure linearity").outcome, Outcome::NotRun);
}

#[test]
fn an_open_interlock_fails_with_a_remedy() {
    let bench = bench(CameraFaults::default());
    bench.control.set_fault(TwinFault::InterlockOpen);
    let checks = bench.examine();
    let light = of(&checks, "light");
    assert!(light.outcome == Outcome::NotOk && light.figure.contains("interlock"), "{light:?}");
    assert!(!light.remedy.is_empty());
}

#[test]
fn a_stalled_stage_fails_with_a_remedy() {
    let bench = bench(CameraFaults::default());
    assert_eq!(bench.control.true_position_mm(), 0.0);
    bench.control.set_fault(TwinFault::StageStall { at_mm: 0.5 * MOVE_MM });
    let (failed, checks) = failed_with(&bench);
    assert_eq!(failed, ["stage position"], "{}", check::table(&checks));
    assert!(!of(&checks, "stage position").remedy.is_empty());
}

/// A board aligned with the stage travel, on a station with enough pixels to read it.
fn bench_with_board() -> Bench {
    let bench = bench_of((640, 512), CameraFaults::default());
    let model = bench.control.model();
    let board = twin::poses::stage_board(&model, &[0.0, MOVE_MM]);
    let along = model.stage.linear().unwrap().direction;
    let normal = (Vector3::z() - along * along.z).normalize();
    let axes = Matrix3::from_columns(&[along, normal.cross(&along), normal]);
    let centre_mm = Vector3::new(0.0, 0.0, model.shape.standoff_mm) - along * (0.5 * MOVE_MM);
    bench.control.place(Scene::Board(Board { axes, centre_mm, ..board }));
    bench
}

#[test]
fn the_scale_of_the_stage_is_checked_with_a_board() {
    let bench = bench_with_board();
    let scale = of(&bench.examine(), "stage scale").clone();
    assert!(scale.outcome == Outcome::Ok && scale.value.unwrap().abs() < SCALE_PERCENT, "{scale:?}");
}

#[test]
fn a_scale_error_fails_the_scale_check() {
    let mut bench = bench_with_board();
    bench.settings.board = chessboard(12.0 * 1.03);
    let scale = of(&bench.examine(), "stage scale").clone();
    // Squares stated 3 % too large are equivalent to a stage that moves 3 % too far.
    assert!(scale.outcome == Outcome::NotOk && (scale.value.unwrap() - 3.0).abs() < SCALE_PERCENT, "{scale:?}");
}

#[test]
fn a_camera_without_frames_fails_and_later_checks_are_not_run() {
    let bench = bench(CameraFaults::default());
    bench.control.set_fault(TwinFault::CameraHang);
    let checks = bench.examine();
    assert!(checks.iter().any(|check| check.name == "frame rate" && check.outcome != Outcome::Ok));
    assert!(checks.iter().all(|check| check.name != "stage scale" || check.outcome == Outcome::NotRun));
    assert!(!answer(&checks).text.is_empty());
}

#[test]
fn cancelling_at_any_step_leaves_the_laser_off_and_the_stage_at_rest() {
    for step in ["running the camera", "turning the laser", "moving the stage"] {
        let bench = bench(CameraFaults::default());
        let (reached, cancel) = channel();
        let stopper = {
            let (station, flag, runtime) =
                (bench.station.clone(), bench.cancel.clone(), bench.runtime.handle().clone());
            std::thread::spawn(move || {
                cancel.recv().unwrap();
                runtime.block_on(stop(&station, &flag));
            })
        };
        let ended = bench.examine_with(move |text| {
            if text.starts_with(step) {
                reached.send(()).unwrap();
            }
        });
        stopper.join().unwrap();
        assert!(ended.is_err(), "{step}: it was not cancelled");
        assert_eq!(bench.control.laser_power(), 0.0, "{step}: laser on");
        assert_eq!(reported_state(&bench.station), "the laser is off, the stage is at rest", "{step}");
        assert!(bench.station.is_halted(), "{step}: Stop is not latched");
    }
}

#[test]
fn without_consent_motion_and_laser_stay_off() {
    let bench = bench(CameraFaults::default());
    let examination = Examination {
        station: &bench.station,
        settings: &bench.settings,
        cancel: &bench.cancel,
        reporter: &Notes(Box::new(|text| {
            assert!(!text.contains("laser on") && !text.contains("stage"), "{text}")
        })),
        runtime: bench.runtime.handle().clone(),
    };
    let checks = examine(&examination, || false).unwrap_or_else(|Cancelled| panic!("nobody cancelled"));
    assert_eq!(of(&checks, "laser and motion").outcome, Outcome::NotRun);
    let at_rest: Vec<&str> = checks.iter().map(|check| check.name).collect();
    assert_eq!(at_rest[..10], ALL[..10]);
    assert_eq!(at_rest.len(), 11);
}
