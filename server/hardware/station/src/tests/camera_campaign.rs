//! Hundreds of camera faults at random moments of a live view or of triggered exposures, with the simulated station, a
//! recording, and a third-party GenICam camera process.
//!
//! Counts hangs, late fault reports (promised: 2 s), light left on, and exposures that neither arrived nor were counted
//! as lost by a reason; each must be 0. The long version is ignored and run by `cargo xtask campaign`. Not covered:
//! physical cameras.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use devices::contract::Stopwatch;
use devices::replay::{ReplayDriver, ReplaySettings};
use genicam::fake_camera::FakeCamera;
use tempfile::TempDir;
use twin::{CaptureRequest, ScanRequest, SceneKind, StationModel, StationShape, TwinFault, capture_folder};

use super::bench::{Bench, bench_of, never_cancelled, small_devices, wait};
use super::matrix::genicam as process;
use super::spy_camera::{Spy, spied};
use crate::{LaserLight, LiveRequest, MachineState, Manual, StationDevices, StationStatus};

/// The kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum FaultKind {
    Loss,
    Late,
    WrongSize,
    FormatChange,
    Unplug,
    Hang,
    Restart,
}

const ALL: [FaultKind; 7] = [
    FaultKind::Loss,
    FaultKind::Late,
    FaultKind::WrongSize,
    FaultKind::FormatChange,
    FaultKind::Unplug,
    FaultKind::Hang,
    FaultKind::Restart,
];

/// Camera faults are reported within this time (`promises.md`).
const REPORT_LIMIT: Duration = Duration::from_secs(2);

/// The laser is off within this time of the report of a fault.
const LASER_OFF_LIMIT: Duration = Duration::from_millis(500);

/// A wait beyond this time counts as a hang.
const HANG: Duration = Duration::from_secs(20);

/// How long exposures are observed after a tolerated fault.
const OBSERVATION_TIME: Duration = Duration::from_millis(400);

/// Reproducible pseudo-random numbers (xorshift).
struct Xorshift(u64);

impl Xorshift {
    fn roll(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % n
    }
}

/// A station, with the functions that inject and clear its camera's faults.
struct Rig<'a> {
    bench: Bench,
    spy: Arc<Spy>,
    inject: Box<dyn Fn(FaultKind) + 'a>,
    clear: Box<dyn Fn() + 'a>,
}

#[derive(Debug, Default)]
struct Tally {
    n_faults: usize,
    n_named: BTreeMap<FaultKind, usize>,
    longest: BTreeMap<FaultKind, Duration>,
    failures: Vec<String>,
}

fn lost(status: &StationStatus) -> u64 {
    status.frames_dropped.iter().filter(|(reason, _)| *reason != "recorder").map(|(_, count)| count).sum()
}

impl Rig<'_> {
    /// Waits until the status fulfils `holds`; returns the time it took, or `None` after `limit`.
    fn wait_for(&self, limit: Duration, holds: impl Fn(&StationStatus) -> bool) -> Option<Duration> {
        let watch = Stopwatch::start();
        while !holds(&self.bench.station.status()) {
            if watch.own_time() > limit {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Some(watch.own_time())
    }

    /// Removes the cause and resets the station, as a person would.
    fn make_ready(&self, tally: &mut Tally) -> bool {
        (self.clear)();
        let watch = Stopwatch::start();
        while self.bench.manual(Manual::Reset).is_err() {
            if watch.own_time() > HANG {
                tally.failures.push(format!("hang: not ready again: {:?}", self.bench.station.status().faults));
                return false;
            }
        }
        true
    }

    /// Injects a fault during a live view or during triggered exposures.
    fn inject_fault(&self, what: FaultKind, live: bool, rng: &mut Xorshift, tally: &mut Tally) {
        let running = Arc::new(AtomicBool::new(true));
        let job = (!live).then(|| self.expose(running.clone()));
        if live {
            wait(self.bench.station.live(LiveRequest { running: true, laser_power: 1.0 })).unwrap();
        }
        if self.wait_for(HANG, |status| status.laser_light == LaserLight::On).is_none() {
            tally.failures.push("hang: the laser does not turn on".to_owned());
        }
        std::thread::sleep(Duration::from_millis(rng.roll(120)));
        tally.n_faults += 1;
        (self.inject)(what);
        let is_tolerated = matches!(what, FaultKind::Loss | FaultKind::Late);
        let limit = if is_tolerated { OBSERVATION_TIME } else { REPORT_LIMIT + Duration::from_secs(1) };
        match self.wait_for(limit, |status| !status.faults.is_empty()) {
            Some(took) => {
                *tally.n_named.entry(what).or_default() += 1;
                let longest = tally.longest.entry(what).or_default();
                *longest = (*longest).max(took);
                if is_tolerated || took > REPORT_LIMIT {
                    let faults = &self.bench.station.status().faults;
                    tally.failures.push(format!("late: reported after {took:?}: {faults:?}"));
                }
                let watch = Stopwatch::start();
                while self.bench.control.laser_power() > 0.0 && watch.own_time() <= LASER_OFF_LIMIT {
                    std::thread::sleep(Duration::from_millis(1));
                }
                if self.bench.control.laser_power() > 0.0 {
                    tally.failures.push("laser left on".to_owned());
                }
            }
            None if is_tolerated => {}
            None => tally.failures.push("late: not reported".to_owned()),
        }
        running.store(false, Ordering::SeqCst);
        if let Some(job) = job {
            job.join().unwrap();
        }
        let stopped = wait(self.bench.station.live(LiveRequest { running: false, laser_power: 0.0 }));
        drop(stopped);
        // Exactly: every exposure arrived, or is counted under its reason.
        let exposed = || self.spy.exposed.load(Ordering::SeqCst);
        let is_exact = |status: &StationStatus| status.frames_arrived + lost(status) == exposed();
        if self.wait_for(Duration::from_secs(2), is_exact).is_none() {
            let status = self.bench.station.status();
            let (arrived, dropped) = (status.frames_arrived, &status.frames_dropped);
            tally.failures.push(format!("counts: {} exposed, {arrived} arrived, lost {dropped:?}", exposed()));
        }
    }

    /// Exposes with light, one frame after the other, until it is ended or a fault ends it.
    fn expose(&self, running: Arc<AtomicBool>) -> std::thread::JoinHandle<()> {
        let lease = self.bench.lease();
        lease.laser_on(1.0).unwrap();
        std::thread::spawn(
            move || while running.load(Ordering::SeqCst) && lease.grab(&never_cancelled()).is_ok() {},
        )
    }
}

fn campaign(name: &str, rig: &Rig<'_>, n_faults: usize) {
    let (mut tally, mut rng) = (Tally::default(), Xorshift(0x9e37_79b9_7f4a_7c15));
    for _ in 0..n_faults {
        let (what, live) = (ALL[rng.roll(ALL.len() as u64) as usize], rng.roll(2) == 0);
        let before = tally.failures.len();
        if rig.make_ready(&mut tally) {
            rig.inject_fault(what, live, &mut rng, &mut tally);
        }
        let scenario = if live { "live" } else { "triggered" };
        tally.failures[before..]
            .iter_mut()
            .for_each(|failure| failure.push_str(&format!(" ({what:?}, {scenario})")));
    }
    rig.make_ready(&mut tally);
    assert!(matches!(rig.bench.station.status().state, MachineState::Operational(_)));
    let count = |word: &str| tally.failures.iter().filter(|failure| failure.starts_with(word)).count();
    println!(
        "{name}: {} faults; {} reported late, {} hangs, {} wrong counts, laser left on {} times",
        tally.n_faults,
        count("late"),
        count("hang"),
        count("counts"),
        count("laser")
    );
    let status = rig.bench.station.status();
    println!("  {} arrived, lost {:?}", status.frames_arrived, status.frames_dropped);
    for (what, n) in &tally.n_named {
        println!("  {what:?}: {n} reported, the last after {:?}", tally.longest[what]);
    }
    assert!(tally.failures.is_empty(), "{name}: {:#?}", tally.failures);
}

/// Number of faults, or `N_FAULTS` of the environment.
fn n_faults(usual: usize) -> usize {
    std::env::var("N_FAULTS").map_or(usual, |n| n.parse().expect("N_FAULTS is a number"))
}

/// Injects a fault between camera and station.
fn inject_after_driver(spy: &Spy, what: FaultKind) {
    match what {
        FaultKind::Loss => spy.loses.store(3, Ordering::SeqCst),
        FaultKind::Late => spy.frame_hang_ms.store(300, Ordering::SeqCst),
        FaultKind::WrongSize => spy.halves_height.store(true, Ordering::SeqCst),
        FaultKind::FormatChange => spy.doubles_depth.store(true, Ordering::SeqCst),
        FaultKind::Unplug => spy.is_unplugged.store(true, Ordering::SeqCst),
        // No more frames arrive.
        FaultKind::Hang => spy.loses.store(u64::MAX, Ordering::SeqCst),
        FaultKind::Restart => {
            spy.is_unplugged.store(true, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(300));
            spy.is_unplugged.store(false, Ordering::SeqCst);
        }
    }
}

fn clear_after_driver(spy: &Spy) {
    spy.loses.store(0, Ordering::SeqCst);
    [&spy.halves_height, &spy.doubles_depth, &spy.is_unplugged]
        .into_iter()
        .for_each(|what| what.store(false, Ordering::SeqCst));
}

fn of_twin(n_faults: usize) {
    let (devices, spy) = spied(small_devices());
    let bench = bench_of(devices);
    let (control, clearing, late) = (bench.control.clone(), bench.control.clone(), spy.clone());
    let inject = move |what| match what {
        FaultKind::Loss => control.set_fault(TwinFault::LostFrames { every: 2 }),
        FaultKind::Late => inject_after_driver(&late, what),
        FaultKind::WrongSize => control.set_fault(TwinFault::WrongFrameSize),
        FaultKind::FormatChange => control.set_fault(TwinFault::WrongPixelFormat),
        FaultKind::Unplug => control.set_fault(TwinFault::CameraUnplugged),
        FaultKind::Hang => control.set_fault(TwinFault::CameraHang),
        FaultKind::Restart => {
            control.set_fault(TwinFault::CameraUnplugged);
            std::thread::sleep(Duration::from_millis(20));
            control.clear_fault(TwinFault::CameraUnplugged.name());
        }
    };
    let clear = move || {
        for fault in TwinFault::EXAMPLES {
            clearing.clear_fault(fault.name());
        }
    };
    campaign("twin", &Rig { bench, spy, inject: Box::new(inject), clear: Box::new(clear) }, n_faults);
}

fn of_replay(n_faults: usize) {
    let folder = TempDir::new().unwrap();
    let capture = folder.path().join("capture");
    let shape = StationShape { width_px: 160, height_px: 128, ..StationShape::default() };
    let scan = ScanRequest { name: "plate".to_owned(), part: SceneKind::Plate, n_frames: 6, step: 0.5 };
    let request = CaptureRequest { n_poses: 0, stage_positions: Vec::new(), scans: vec![scan] };
    let model = StationModel::seeded(7, &shape).unwrap();
    capture_folder(&model, &request, &capture, &|_| ControlFlow::Continue(())).unwrap();
    let replay = Arc::new(ReplayDriver(ReplaySettings { folder: capture, ..ReplaySettings::default() }));
    let (devices, spy) = spied(StationDevices { camera: replay.clone(), stage: replay, ..small_devices() });
    let bench = bench_of(devices);
    let (injecting, clearing) = (spy.clone(), spy.clone());
    let inject = move |what| inject_after_driver(&injecting, what);
    let clear = move || clear_after_driver(&clearing);
    campaign("replay", &Rig { bench, spy, inject: Box::new(inject), clear: Box::new(clear) }, n_faults);
}

/// Faults that cannot be injected into the process are injected after the driver.
fn of_genicam(n_faults: usize) {
    let Some(camera) = process::fake(0).map(RefCell::new) else { return };
    let (devices, spy) = spied(process::devices(small_devices()));
    let bench = bench_of(devices);
    bench.wait_for("camera connected", |status| status.camera.connected);
    process::set_small(&bench);
    let camera: &RefCell<FakeCamera> = &camera;
    let (injecting, clearing) = (spy.clone(), spy.clone());
    let inject = move |what| match what {
        FaultKind::Late => {
            camera.borrow().hold();
            std::thread::sleep(Duration::from_millis(300));
            camera.borrow().resume();
        }
        FaultKind::Unplug => camera.borrow_mut().kill(),
        FaultKind::Hang => camera.borrow().hold(),
        FaultKind::Restart => camera.borrow_mut().restart().unwrap(),
        FaultKind::Loss | FaultKind::WrongSize | FaultKind::FormatChange => inject_after_driver(&injecting, what),
    };
    let clear = move || {
        clear_after_driver(&clearing);
        camera.borrow().resume();
        if camera.borrow().has_ended() {
            camera.borrow_mut().restart().unwrap();
        }
    };
    campaign("genicam", &Rig { bench, spy, inject: Box::new(inject), clear: Box::new(clear) }, n_faults);
}

#[test]
fn a_few_faults_of_the_simulated_camera() {
    of_twin(5);
}

#[test]
fn a_few_faults_of_a_recording() {
    of_replay(5);
}

#[test]
#[ignore = "hundreds of faults take minutes: `cargo xtask campaign`"]
fn two_hundred_faults_of_the_simulated_camera() {
    of_twin(n_faults(200));
}

#[test]
#[ignore = "hundreds of faults take minutes: `cargo xtask campaign`"]
fn a_hundred_faults_of_a_recording() {
    of_replay(n_faults(100));
}

#[test]
#[ignore = "hundreds of faults take minutes: `cargo xtask campaign`"]
fn two_hundred_faults_of_a_genicam_camera() {
    of_genicam(n_faults(200));
}
