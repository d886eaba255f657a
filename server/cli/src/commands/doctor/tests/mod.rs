//! The doctor over the simulated station: a sound one passes, and each fault turns its own checks red.
//!
//! Not shown here: that the limits suit cameras of glass and silicon.

mod unsound;

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
use unsound::{Unsound, UnsoundCamera};

/// Rate of the camera, Hz: a small picture is rendered sooner than that.
const RATE_HZ: f64 = 60.0;

struct Bench {
    station: StationHandle,
    control: TwinControl,
    runtime: tokio::runtime::Runtime,
    wanted: Wanted,
    cancel: CancelFlag,
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.station.shut_down();
    }
}

/// A small simulated station with a plate, and a camera that is sound or not.
fn bench(unsound: Unsound) -> Bench {
    bench_of((320, 256), unsound)
}

fn bench_of((width_px, height_px): (usize, usize), unsound: Unsound) -> Bench {
    let shape = StationShape { width_px, height_px, ..StationShape::default() };
    let options = TwinOptions { scene: SceneKind::Plate, ..TwinOptions::default() };
    let world = TwinStation::new(StationModel::seeded(7, &shape).unwrap(), options);
    let control = world.control();
    let twin = Arc::new(TwinDriver::over(world));
    let camera = Arc::new(UnsoundCamera { twin: twin.clone(), unsound });
    let devices = StationDevices { camera, stage: twin.clone(), laser: twin.clone(), twin: Some(twin) };
    let station = StationHandle::start(&devices, false);
    let wanted = Wanted {
        exposure_us: Some(700.0),
        gain_db: None,
        frame_rate_hz: Some(RATE_HZ),
        power: 1.0,
        board: chessboard(12.0),
        lines_along_rows: true,
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
    Bench { station, control, runtime, wanted, cancel: CancelFlag::default() }
}

fn chessboard(square_mm: f64) -> capture::Target {
    let (inner_columns, inner_rows) = BOARD_CORNERS;
    capture::Target::Chessboard(capture::ChessboardTarget {
        inner_columns,
        inner_rows,
        square_mm: square_mm.into(),
    })
}

/// Notes what is done.
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
            wanted: &self.wanted,
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

/// Names of the checks that are red.
fn red(checks: &[Check]) -> Vec<&'static str> {
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
fn a_sound_station_passes_every_check() {
    let bench = bench(Unsound::default());
    let checks = bench.examine();
    let names: Vec<&str> = checks.iter().map(|check| check.name).collect();
    assert_eq!(names, ALL);
    // Of this machine's own lateness the rate and the jitter say nothing here: they have tests of their own.
    let red: Vec<_> = red(&checks).into_iter().filter(|name| !OF_THE_MACHINE.contains(name)).collect();
    assert!(red.is_empty(), "{}", check::table(&checks));
    assert_eq!(of(&checks, "stage scale").outcome, Outcome::NotRun, "there is no board");
    assert_eq!(bench.control.laser_power(), 0.0);
}

/// Checks that a machine with other work to do fails without any fault of the station.
const OF_THE_MACHINE: [&str; 3] = ["frame rate", "timestamp jitter", "frames lost"];

/// Examines a station with a fault; the checks that turn red beyond those of the machine.
fn red_with(bench: &Bench) -> (Vec<&'static str>, Vec<Check>) {
    let checks = bench.examine();
    let red = red(&checks).into_iter().filter(|name| !OF_THE_MACHINE.contains(name)).collect();
    (red, checks)
}

#[test]
fn lost_frames_are_counted_by_reason() {
    let bench = bench(Unsound::default());
    bench.control.set_fault(TwinFault::LostFrames { every: 10 });
    let lost = of(&bench.examine(), "frames lost").clone();
    assert_eq!(lost.outcome, Outcome::NotOk);
    // Of 120 frames every tenth.
    assert!(lost.value.unwrap() >= 11.0 && lost.figure.contains("camera"), "{lost:?}");
    assert!(!lost.remedy.is_empty());
}

#[test]
fn time_stamps_that_scatter_are_named() {
    let mut bench = bench(Unsound { jitter_ms: 8.0, ..Unsound::default() });
    bench.wanted.frame_rate_hz = Some(20.0);
    let jitter = of(&bench.examine(), "timestamp jitter").clone();
    // Every other frame 8 ms early: ±4 ms about a steady rate, and what the machine adds.
    assert!(jitter.outcome == Outcome::NotOk && jitter.value.unwrap() > 3900.0, "{jitter:?}");
}

#[test]
fn a_response_by_a_gamma_curve_is_named_and_nothing_else() {
    let bench = bench(Unsound { gamma: 2.2, ..Unsound::default() });
    let (red, checks) = red_with(&bench);
    assert_eq!(red, ["exposure linearity"], "{}", check::table(&checks));
}

#[test]
fn too_long_an_exposure_saturates_lines() {
    let mut bench = bench(Unsound::default());
    bench.wanted.exposure_us = Some(5000.0);
    let (red, checks) = red_with(&bench);
    assert_eq!(red, ["line saturation"], "{}", check::table(&checks));
}

#[test]
fn high_gain_makes_noise() {
    let mut bench = bench(Unsound::default());
    (bench.wanted.exposure_us, bench.wanted.gain_db) = (Some(40.0), Some(24.0));
    let (red, checks) = red_with(&bench);
    assert!(red.contains(&"dark noise"), "{}", check::table(&checks));
}

#[test]
fn defects_of_the_sensor_are_counted_behind_a_covered_lens() {
    let bench = bench(Unsound::default());
    let at_rest = || {
        let checks = bench.examine();
        of(&checks, "sensor defects").clone()
    };
    bench.control.set_fault(TwinFault::LensCovered);
    let sound = at_rest();
    assert!(sound.outcome == Outcome::Ok && sound.value == Some(0.0), "{sound:?}");
    bench.control.set_fault(TwinFault::WornSensor { levels: 6.0 });
    let worn = at_rest();
    // One pixel in two thousand of 320 × 256, some of them drawn twice.
    assert!(worn.outcome == Outcome::NotOk && (37.0..=40.0).contains(&worn.value.unwrap()), "{worn:?}");
}

#[test]
fn light_that_stays_on_is_named_and_nothing_moves_then() {
    let bench = bench(Unsound::default());
    bench.control.follow_laser(|_| 1.0);
    let checks = bench.examine();
    let light = of(&checks, "light");
    assert!(light.outcome == Outcome::NotOk && light.figure.contains("although it was switched off"), "{light:?}");
    assert_eq!(of(&checks, "stage position").outcome, Outcome::NotRun);
}

#[test]
fn light_that_its_driver_calls_off_is_seen_in_the_picture() {
    // Dark after each of three exposures, and lit after the fourth time that the laser was switched off.
    let bench = bench(Unsound { lit_from_fall: 4, ..Unsound::default() });
    let (red, checks) = red_with(&bench);
    assert_eq!(red, ["laser off on command"], "{}", check::table(&checks));
}

#[test]
fn light_that_does_not_come_is_named() {
    let bench = bench(Unsound::default());
    bench.control.follow_laser(|_| 0.0);
    let (red, checks) = red_with(&bench);
    assert_eq!(red, ["light"], "{}", check::table(&checks));
}

#[test]
fn light_too_faint_for_lines_is_shown_by_the_missing_lines() {
    let mut bench = bench(Unsound::default());
    bench.wanted.power = 0.02;
    let (red, checks) = red_with(&bench);
    assert_eq!(red, ["laser lines"], "{}", check::table(&checks));
    assert_eq!(of(&checks, "exposure linearity").outcome, Outcome::NotRun);
}

#[test]
fn an_open_interlock_is_named_with_its_remedy() {
    let bench = bench(Unsound::default());
    bench.control.set_fault(TwinFault::InterlockOpen);
    let checks = bench.examine();
    let light = of(&checks, "light");
    assert!(light.outcome == Outcome::NotOk && light.figure.contains("interlock"), "{light:?}");
    assert!(!light.remedy.is_empty());
}

#[test]
fn a_stage_that_stalls_is_named() {
    let bench = bench(Unsound::default());
    assert_eq!(bench.control.true_position_mm(), 0.0);
    bench.control.set_fault(TwinFault::StageStall { at_mm: 0.5 * MOVE_MM });
    let (red, checks) = red_with(&bench);
    assert_eq!(red, ["stage position"], "{}", check::table(&checks));
    assert!(!of(&checks, "stage position").remedy.is_empty());
}

/// A board that lies along the stage's way, on a station with enough pixels to read it.
fn bench_with_board() -> Bench {
    let bench = bench_of((640, 512), Unsound::default());
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
fn a_board_on_the_stage_shows_its_scale() {
    let bench = bench_with_board();
    let scale = of(&bench.examine(), "stage scale").clone();
    assert!(scale.outcome == Outcome::Ok && scale.value.unwrap().abs() < SCALE_PERCENT, "{scale:?}");
}

#[test]
fn a_stage_of_another_scale_than_the_board_is_named() {
    let mut bench = bench_with_board();
    bench.wanted.board = chessboard(12.0 * 1.03);
    let scale = of(&bench.examine(), "stage scale").clone();
    // Squares that are stated 3 % too large are as good as a stage that goes 3 % too far.
    assert!(scale.outcome == Outcome::NotOk && (scale.value.unwrap() - 3.0).abs() < SCALE_PERCENT, "{scale:?}");
}

#[test]
fn a_camera_that_sends_nothing_is_named_and_the_rest_is_not_run() {
    let bench = bench(Unsound::default());
    bench.control.set_fault(TwinFault::CameraHang);
    let checks = bench.examine();
    assert!(checks.iter().any(|check| check.name == "frame rate" && check.outcome != Outcome::Ok));
    assert!(checks.iter().all(|check| check.name != "stage scale" || check.outcome == Outcome::NotRun));
    assert!(!answer(&checks).text.is_empty());
}

#[test]
fn cancelled_at_any_step_it_leaves_the_laser_off_and_the_stage_at_rest() {
    for step in ["running the camera", "turning the laser", "moving the stage"] {
        let bench = bench(Unsound::default());
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
        assert!(ended.is_err(), "{step}: it went on");
        assert_eq!(bench.control.laser_power(), 0.0, "{step}: light");
        assert!(!bench.station.status().moving, "{step}: motion");
        assert!(bench.station.is_halted(), "{step}: not latched");
    }
}

#[test]
fn without_consent_motion_and_laser_stay_off() {
    let bench = bench(Unsound::default());
    let examination = Examination {
        station: &bench.station,
        wanted: &bench.wanted,
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
