//! One cell of the fault matrix: a station in a state, a fault, and the required reaction with its time limit.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use devices::contract::Stopwatch;

use crate::tests::bench::{Bench, never_cancelled, wait, wait_until};
use crate::{Fault, LaserLight, LiveRequest, MachineState, Manual, StationRefusal, StationStatus, Sweep};

/// State of the station when the fault occurs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scenario {
    /// Being started: the fault is present already.
    Absent,
    /// Idle.
    Ready,
    /// A live view with light.
    Live,
    /// A continuous run with light.
    Scanning,
    /// Moving, exposing with light and without, as during a calibration.
    Calibrating,
    /// A person's jog.
    Jogging,
    /// Homing.
    Homing,
}

/// Required reaction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reaction {
    /// A fault of that device and kind, in time; the station is in error, laser off and stage at rest.
    Reported(&'static str, &'static str),
    /// The same, of one of two kinds, depending on whether the station or the driver detects it first.
    ReportedEither(&'static str, [&'static str; 2]),
    /// Nothing until the device is used; then the same.
    ReportedAtUse(&'static str, &'static str),
    /// The scan ends with a refusal and the light goes off; there is no fault.
    EndsScan,
    /// The fault does not concern the station's activity; it continues.
    Continues,
}

/// A station, a fault and how it is cleared.
pub struct Rig<'a> {
    /// The station.
    pub bench: &'a Bench,
    /// Injects the fault.
    pub inject: &'a dyn Fn(),
    /// Removes the cause.
    pub clear: &'a dyn Fn(),
    /// Presses the reset button of a controller that requires it.
    pub press_button: &'a dyn Fn(),
    /// Whether the laser is on, according to the simulation.
    pub light: &'a dyn Fn() -> bool,
    /// Whether there is motion, according to the simulation.
    pub motion: &'a dyn Fn() -> bool,
    /// Whether the stage can receive a stop during the fault.
    pub stop_reaches_stage: bool,
    /// Time within which a fault of stage or laser is reported: a second, unless the page states another.
    pub report_limit: Duration,
}

/// Camera faults are reported within this time.
const CAMERA_REPORT_LIMIT: Duration = Duration::from_secs(2);

/// Serial faults are reported within this time.
pub const REPORT_LIMIT: Duration = Duration::from_secs(1);

/// Light ends within half a second of the fault report.
const LASER_OFF_LIMIT: Duration = Duration::from_millis(500);

/// How long a cell checks that nothing happens.
const OBSERVATION_TIME: Duration = Duration::from_millis(200);

/// Checks the cell with a station that is ready; for “absent” it was started with the fault, for “homing” it is not
/// homed.
pub fn check(rig: &Rig<'_>, scenario: Scenario, reaction: Reaction) {
    let activity = Activity::begin(rig.bench, scenario);
    let injected = Stopwatch::start();
    if scenario != Scenario::Absent {
        (rig.inject)();
    }
    let (device, kinds): (&str, &[&str]) = match &reaction {
        Reaction::Reported(device, kind) | Reaction::ReportedAtUse(device, kind) => {
            (device, std::slice::from_ref(kind))
        }
        Reaction::ReportedEither(device, kinds) => (device, kinds),
        Reaction::Continues | Reaction::EndsScan => ("", &[]),
    };
    match reaction {
        Reaction::Reported(..) | Reaction::ReportedEither(..) => {
            expect_reported(rig, device, kinds, injected);
            activity.expect_ended_by_fault();
            if scenario == Scenario::Absent {
                // It cannot be used as long as the cause lasts.
                let reset = rig.bench.manual(Manual::Reset);
                assert!(matches!(reset, Err(StationRefusal::InError { .. })), "the reset ended with {reset:?}");
            }
        }
        Reaction::ReportedAtUse(..) => {
            std::thread::sleep(OBSERVATION_TIME);
            assert_eq!(rig.bench.station.status().faults, []);
            activity.end(rig.bench);
            let used = Stopwatch::start();
            let in_use = use_device(rig.bench, device);
            expect_reported(rig, device, kinds, used);
            in_use.join().unwrap();
        }
        Reaction::EndsScan => {
            let refusal = activity.job.expect("a scan").join().unwrap();
            assert!(matches!(refusal, Some(StationRefusal::BeltStopped { .. })), "got {refusal:?}");
            wait_until("laser off", || !(rig.light)());
            let status = rig.bench.station.status();
            assert_eq!(status.faults, []);
            assert!(matches!(status.state, MachineState::Operational(_)), "{:?}", status.state);
            return (rig.clear)();
        }
        Reaction::Continues => {
            std::thread::sleep(OBSERVATION_TIME);
            let status = rig.bench.station.status();
            assert_eq!(status.faults, []);
            assert!(matches!(status.state, MachineState::Operational(_)), "{:?}", status.state);
            activity.end(rig.bench);
            return;
        }
    }
    (rig.clear)();
    if rig.bench.manual(Manual::Reset).is_err() {
        (rig.press_button)();
        rig.bench.manual(Manual::Reset).unwrap();
    }
    expect_recovered(rig.bench, reaction);
    assert!(!(rig.light)(), "a reset leaves laser and motion off");
}

fn expect_reported(rig: &Rig<'_>, device: &str, kinds: &[&str], since: Stopwatch) {
    let named = |status: &StationStatus| {
        let is_it =
            |fault: &Fault| fault.device == device && kinds.contains(&fault.kind) && !fault.remedy.is_empty();
        status.faults.iter().any(is_it)
    };
    rig.bench.wait_for(&format!("report of {device} {kinds:?}"), named);
    let took = since.own_time();
    let limit = if device == "camera" { CAMERA_REPORT_LIMIT } else { rig.report_limit };
    assert!(took <= limit, "{device} {kinds:?} was reported after {took:?}");
    let off_after = wait_until("laser off", || !(rig.light)());
    assert!(off_after <= LASER_OFF_LIMIT, "laser off {off_after:?} after the fault was reported");
    // Preoperational: it was never connected.
    let is_faulted =
        |status: &StationStatus| matches!(status.state, MachineState::Error | MachineState::Preoperational);
    rig.bench.wait_for("in error", is_faulted);
    rig.bench.wait_for("reported off", |status| status.laser_light != LaserLight::On);
    if rig.stop_reaches_stage {
        wait_until("at rest", || !(rig.motion)());
    }
    if device == "stage" {
        let status = rig.bench.station.status();
        assert_eq!((status.position_mm, status.homed), (None, false), "its position is unknown");
    }
    assert!(matches!(rig.bench.try_lease().map(drop), Err(StationRefusal::InError { .. })));
    assert!(matches!(rig.bench.manual(Manual::Home), Err(StationRefusal::InError { .. })));
}

/// After the cause is removed, a person's reset makes the station ready; a lost position requires homing.
fn expect_recovered(bench: &Bench, reaction: Reaction) {
    let status = bench.station.status();
    assert_eq!(status.faults, []);
    assert!(matches!(status.state, MachineState::Operational(_)), "{:?}", status.state);
    assert!(!status.moving && status.job_id.is_none());
    if let Reaction::Reported("stage", _) | Reaction::ReportedAtUse("stage", _) = reaction {
        assert_eq!((status.position_mm, status.homed), (None, false), "a reset does not restore the position");
        bench.manual(Manual::Home).unwrap();
    }
    bench.wait_for("ready", |status| status.activity == "ready" || status.activity == "not homed");
    if bench.station.status().activity == "not homed" {
        bench.manual(Manual::Home).unwrap();
        bench.wait_for("ready", |status| status.activity == "ready");
    }
    bench.lease().grab(&never_cancelled()).unwrap();
}

/// Uses a device, so that its fault is detected.
fn use_device(bench: &Bench, device: &str) -> JoinHandle<()> {
    let station = bench.station.clone();
    let stage = device == "stage";
    std::thread::spawn(move || {
        if stage {
            let command = Manual::Move { target_mm: 20.0, speed_mm_s: Some(100.0) };
            drop(wait(station.manual(command)));
        } else {
            assert!(wait(station.snapshot()).is_err());
        }
    })
}

/// The station's activity.
struct Activity {
    job: Option<JoinHandle<Option<StationRefusal>>>,
    running: Arc<AtomicBool>,
    scenario: Scenario,
}

impl Activity {
    fn begin(bench: &Bench, scenario: Scenario) -> Self {
        let running = Arc::new(AtomicBool::new(true));
        let job_running = running.clone();
        let job = match scenario {
            Scenario::Absent | Scenario::Ready => None,
            Scenario::Live => {
                wait(bench.station.live(LiveRequest { running: true, laser_power: 1.0 })).unwrap();
                bench.wait_for("live with light", |status| {
                    status.laser_light == LaserLight::On && status.frames_arrived > 2
                });
                None
            }
            Scenario::Homing => {
                bench.manual(Manual::Home).unwrap();
                bench.wait_for("homing", |status| status.moving);
                None
            }
            Scenario::Scanning => Some(scanning(bench, job_running)),
            Scenario::Calibrating => Some(calibrating(bench, job_running)),
            Scenario::Jogging => Some(jogging(bench, job_running)),
        };
        Self { job, running, scenario }
    }

    /// The fault ended it: the job got the error.
    fn expect_ended_by_fault(self) {
        let Some(job) = self.job else { return };
        let refusal = job.join().unwrap().expect("the fault ended it");
        let result = matches!(
            refusal,
            StationRefusal::Camera(_)
                | StationRefusal::Stage(_)
                | StationRefusal::Laser(_)
                | StationRefusal::NoFrame { .. }
                | StationRefusal::InError { .. }
        );
        assert!(result, "got {refusal:?}");
    }

    /// Continues until it is ended.
    fn end(self, bench: &Bench) {
        self.running.store(false, Ordering::SeqCst);
        if let Some(job) = self.job {
            let refusal = job.join().unwrap();
            assert!(refusal.is_none(), "it was ended by {refusal:?}");
        }
        match self.scenario {
            Scenario::Live => {
                let frames = bench.station.status().frames_arrived;
                bench.wait_for("live", |status| status.frames_arrived > frames);
                wait(bench.station.live(LiveRequest { running: false, laser_power: 0.0 })).unwrap();
            }
            Scenario::Homing => drop(bench.wait_for("homed", |status| !status.moving && status.homed)),
            // A jog ends without repetition.
            Scenario::Jogging => drop(bench.wait_for("at rest", |status| !status.moving)),
            Scenario::Absent | Scenario::Ready | Scenario::Scanning | Scenario::Calibrating => {}
        }
    }
}

fn scanning(bench: &Bench, running: Arc<AtomicBool>) -> JoinHandle<Option<StationRefusal>> {
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let sweep = Sweep { from_mm: 0.0, to_mm: 35.0, speed_mm_s: 5.0, frame_rate_hz: 50.0 };
    let stream = lease.sweep(&sweep, &never_cancelled()).unwrap();
    stream.frames.recv().unwrap();
    std::thread::spawn(move || {
        let _lease = lease;
        while running.load(Ordering::SeqCst) {
            if stream.frames.recv().is_err() {
                return stream.end_reason();
            }
        }
        None
    })
}

fn calibrating(bench: &Bench, running: Arc<AtomicBool>) -> JoinHandle<Option<StationRefusal>> {
    let lease = bench.lease();
    let first = Arc::new(AtomicBool::new(false));
    let begun = first.clone();
    let job = std::thread::spawn(move || {
        while running.load(Ordering::SeqCst) {
            let round = || {
                lease.move_to(10.0, Some(100.0), &never_cancelled())?;
                lease.grab(&never_cancelled())?;
                lease.laser_on(1.0)?;
                lease.grab(&never_cancelled())?;
                first.store(true, Ordering::SeqCst);
                lease.laser_off()?;
                lease.move_to(0.0, Some(100.0), &never_cancelled())
            };
            if let Err(refusal) = round() {
                return Some(refusal);
            }
        }
        None
    });
    wait_until("calibrating", || begun.load(Ordering::SeqCst) || job.is_finished());
    job
}

fn jogging(bench: &Bench, running: Arc<AtomicBool>) -> JoinHandle<Option<StationRefusal>> {
    let station = bench.station.clone();
    let job = std::thread::spawn(move || {
        while running.load(Ordering::SeqCst) {
            if let Err(refusal) = wait(station.manual(Manual::Jog { velocity_mm_s: 5.0 })) {
                return Some(refusal);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        None
    });
    bench.wait_for("jogging", |status| status.moving);
    job
}

/// The cells of a table: `row: fault => column: reaction, …;` becomes a module with a test for each column.
macro_rules! cells {
    ($cell:ident; $($row:ident: $fault:expr => $($column:ident: $reaction:expr),+;)+) => {
        $(mod $row {
            use super::*;

            $(#[test]
            fn $column() {
                $cell($crate::tests::matrix::cell::scenario(stringify!($column)), $fault, $reaction);
            })+
        })+
    };
}
pub(super) use cells;

/// The activity of the station in the cells of a column.
pub fn scenario(column: &str) -> Scenario {
    match column {
        "absent" => Scenario::Absent,
        "ready" => Scenario::Ready,
        "live" => Scenario::Live,
        "scanning" => Scenario::Scanning,
        "calibrating" => Scenario::Calibrating,
        "jogging" => Scenario::Jogging,
        "homing" => Scenario::Homing,
        _ => panic!("no column {column}"),
    }
}
