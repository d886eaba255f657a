//! A vendor's call that blocks for ten seconds: Stop ends light and motion anyway, whichever device it belongs to.
//!
//! Light and motion are observed in the simulated world. Not covered: a library that cannot stop a device during
//! another call; a driver over it cannot provide the handle that every stage and every switched laser must have.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use devices::contract::Stopwatch;
use devices::{
    AcceptedMove, Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, DeviceIdentity,
    DeviceSet, Driver, FrameInfo, Laser, LaserCapabilities, LaserError, LaserState, OpenError, Opened, Stage,
    StageCapabilities, StageError, StageState, StopHandle,
};
use vision::GreyImage;

use super::bench::{Bench, bench_of, never_cancelled, small_devices, wait, wait_until};
use crate::{MachineState, Manual, StationDevices, StationRefusal, Sweep};

/// Duration of the blocking call, unless the test ends earlier.
const BLOCKS: Duration = Duration::from_secs(10);

/// Light and motion end within this time of a Stop.
const STOP_LIMIT: Duration = Duration::from_millis(200);

/// A call that blocks on request.
#[derive(Debug, Default)]
struct Gate {
    is_shut: Mutex<bool>,
    opened: Condvar,
    /// Whether a call is blocked.
    is_waited_at: AtomicBool,
}

impl Gate {
    fn shut(&self) {
        *self.is_shut.lock().unwrap() = true;
    }

    fn open(&self) {
        *self.is_shut.lock().unwrap() = false;
        self.opened.notify_all();
    }

    /// Called at the start of every device call.
    fn pass(&self) {
        let is_shut = self.is_shut.lock().unwrap();
        if *is_shut {
            self.is_waited_at.store(true, Ordering::SeqCst);
            let _open = self.opened.wait_timeout_while(is_shut, BLOCKS, |is_shut| *is_shut).unwrap();
        }
    }
}

/// A device whose driver blocks: every call goes through the gate.
struct Blocking<D: ?Sized> {
    gate: Arc<Gate>,
    device: Box<D>,
}

impl<D: ?Sized> Blocking<D> {
    fn pass(&mut self) -> &mut D {
        self.gate.pass();
        &mut self.device
    }
}

/// The devices whose calls go through the gate.
#[derive(Debug)]
struct BlockingDriver {
    driver: Arc<dyn Driver>,
    gate: Arc<Gate>,
    blocked: DeviceSet,
}

impl Driver for BlockingDriver {
    fn kind(&self) -> &'static str {
        self.driver.kind()
    }

    fn makes(&self) -> DeviceSet {
        self.driver.makes()
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let Opened { mut camera, mut stage, mut laser } = self.driver.open(wanted)?;
        let gate = || self.gate.clone();
        if self.blocked.camera {
            camera = camera.map(|device| Box::new(Blocking { gate: gate(), device }) as Box<dyn Camera>);
        }
        if self.blocked.stage {
            stage = stage.map(|device| Box::new(Blocking { gate: gate(), device }) as Box<dyn Stage>);
        }
        if self.blocked.laser {
            laser = laser.map(|device| Box::new(Blocking { gate: gate(), device }) as Box<dyn Laser>);
        }
        Ok(Opened { camera, stage, laser })
    }
}

impl Camera for Blocking<dyn Camera> {
    fn identity(&self) -> DeviceIdentity {
        self.device.identity()
    }

    fn capabilities(&self) -> CameraCapabilities {
        self.device.capabilities()
    }

    fn settings(&self) -> CameraSettings {
        self.device.settings()
    }

    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        self.pass().configure(wanted)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        self.pass().start()
    }

    fn trigger(&mut self) -> Result<(), CameraError> {
        self.pass().trigger()
    }

    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError> {
        self.pass().next_frame(image, timeout)
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.pass().stop()
    }

    fn reconnect(&mut self) -> Result<(), CameraError> {
        self.pass().reconnect()
    }
}

impl Stage for Blocking<dyn Stage> {
    fn identity(&self) -> DeviceIdentity {
        self.device.identity()
    }

    fn capabilities(&self) -> StageCapabilities {
        self.device.capabilities()
    }

    fn start_home(&mut self) -> Result<(), StageError> {
        self.pass().start_home()
    }

    fn start_move(&mut self, target_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.pass().start_move(target_mm, speed_mm_s)
    }

    fn start_jog(&mut self, distance_mm: f64, speed_mm_s: f64) -> Result<AcceptedMove, StageError> {
        self.pass().start_jog(distance_mm, speed_mm_s)
    }

    fn poll(&mut self) -> Result<StageState, StageError> {
        self.pass().poll()
    }

    fn hold(&mut self) -> Result<(), StageError> {
        self.pass().hold()
    }

    fn resume(&mut self) -> Result<(), StageError> {
        self.pass().resume()
    }

    fn stop(&mut self) -> Result<(), StageError> {
        self.pass().stop()
    }

    fn stop_handle(&self) -> Arc<dyn StopHandle> {
        self.device.stop_handle()
    }

    fn clear_fault(&mut self) -> Result<(), StageError> {
        self.pass().clear_fault()
    }

    fn reconnect(&mut self) -> Result<(), StageError> {
        self.pass().reconnect()
    }
}

impl Laser for Blocking<dyn Laser> {
    fn identity(&self) -> DeviceIdentity {
        self.device.identity()
    }

    fn capabilities(&self) -> LaserCapabilities {
        self.device.capabilities()
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        self.pass().switch_on(power, lease)
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.pass().renew(lease)
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        self.pass().switch_off()
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        self.device.stop_handle()
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.pass().poll()
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.pass().reconnect()
    }
}

/// A station in which these devices block on request.
fn blocking_bench(blocked: DeviceSet) -> (Bench, Arc<Gate>) {
    let gate = Arc::new(Gate::default());
    let devices = small_devices();
    let driver = Arc::new(BlockingDriver { driver: devices.camera, gate: gate.clone(), blocked });
    let (stage, laser) = (driver.clone(), driver.clone());
    // The driver contains its own simulated world; no other device acts on it.
    let bench = bench_of(StationDevices { camera: driver, stage, laser, twin: devices.twin });
    bench.wait_for("ready", |status| status.activity == "ready");
    (bench, gate)
}

/// A sweep with light during which a call to one device blocks.
fn stop_ends_light_and_motion_with_a_blocked(blocked: DeviceSet) {
    let (bench, gate) = blocking_bench(blocked);
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let sweep = Sweep { from_mm: 0.0, to_mm: 90.0, speed_mm_s: 5.0, frame_rate_hz: 50.0 };
    let stream = lease.sweep(&sweep, &never_cancelled()).unwrap();
    stream.frames.recv().unwrap();
    gate.shut();
    wait_until("blocked", || gate.is_waited_at.load(Ordering::SeqCst));
    assert!(bench.control.laser_power() > 0.0, "it must be on when Stop comes");
    let requested = Stopwatch::start();
    wait(bench.station.stop("a person")).unwrap();
    let is_moving = || {
        let before_mm = bench.control.true_position_mm();
        std::thread::sleep(Duration::from_millis(2));
        bench.control.true_position_mm() != before_mm
    };
    wait_until("off and at rest", || bench.control.laser_power() == 0.0 && !is_moving());
    let took = requested.own_time();
    assert!(took <= STOP_LIMIT, "light or motion for {took:?} after Stop");
    assert!(bench.station.is_halted());
    let rests_at_mm = bench.control.true_position_mm();

    gate.open();
    bench.wait_for("halted", |status| status.state == MachineState::Halted);
    stream.frames.iter().for_each(drop);
    assert!(matches!(stream.end_reason(), Some(StationRefusal::Stopped { actor }) if actor == "a person"));
    assert_eq!((bench.control.true_position_mm(), bench.control.laser_power()), (rests_at_mm, 0.0));
    drop(lease);
    bench.manual(Manual::Reset).unwrap();
    bench.wait_for("ready", |status| status.activity == "ready");
}

#[test]
fn stop_ends_light_and_motion_while_a_call_to_the_camera_blocks() {
    stop_ends_light_and_motion_with_a_blocked(DeviceSet { camera: true, ..DeviceSet::default() });
}

#[test]
fn stop_ends_light_and_motion_while_a_call_to_the_stage_blocks() {
    stop_ends_light_and_motion_with_a_blocked(DeviceSet { stage: true, ..DeviceSet::default() });
}

#[test]
fn stop_ends_light_and_motion_while_a_call_to_the_laser_blocks() {
    stop_ends_light_and_motion_with_a_blocked(DeviceSet { laser: true, ..DeviceSet::default() });
}

#[test]
fn a_stop_that_blocks_is_answered_anyway() {
    let (bench, gate) = blocking_bench(DeviceSet { stage: true, ..DeviceSet::default() });
    bench.manual(Manual::Move { target_mm: 90.0, speed_mm_s: Some(5.0) }).unwrap();
    gate.shut();
    wait_until("blocked", || gate.is_waited_at.load(Ordering::SeqCst));
    for _ in 0..3 {
        wait(bench.station.stop("a person")).unwrap();
    }
    gate.open();
    bench.wait_for("halted", |status| status.state == MachineState::Halted);
}
