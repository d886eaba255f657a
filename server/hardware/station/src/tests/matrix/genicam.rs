//! A third-party GenICam camera, aravis' GigE Vision camera as a separate process, with the simulated stage and laser.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Duration;

use devices::{CameraRequest, DeviceSet, Driver, OpenError, Roi};
use genicam::fake_camera::{FakeCamera, FakeOptions, PROGRAM};
use genicam::{GenicamDriver, GenicamSettings};

use super::cell::Reaction::{self, Continues, Reported, ReportedEither};
use super::cell::{REPORT_LIMIT, Rig, Scenario, cells, check};
use crate::tests::bench::{Bench, bench_of, small_twin, wait};
use crate::{LiveRequest, MachineState, Manual, StationDevices, StationRefusal};

/// Serial number of the camera process.
const SERIAL: &str = "SHEAF03";

/// Packet size of a network with jumbo frames.
const PACKET_SIZE_BYTES: u32 = 8000;

/// Packets lost per thousand by a lossy camera: one of eight frames, which have 35 packets, is incomplete. With half of
/// them incomplete (20 per thousand), so many exposures failed in a row in one of a dozen runs that the camera was silent.
const LOST_PER_THOUSAND: u32 = 4;

/// A fault of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
enum InjectedFault {
    /// Loss of power.
    Unplugged,
    /// It neither answers nor sends.
    Hang,
    /// It is switched off and on.
    Restart,
    /// It loses packets, from the start.
    LostPackets,
    /// Another program controls it.
    ControlledElsewhere,
}

fn driver() -> GenicamDriver {
    let serial = SERIAL.to_owned();
    GenicamDriver(GenicamSettings { serial, packet_size_bytes: PACKET_SIZE_BYTES, ..GenicamSettings::default() })
}

/// Whether the driver is built; otherwise a test that needs it is recorded as not run.
fn is_built() -> bool {
    let wanted = DeviceSet { camera: true, ..DeviceSet::default() };
    let never_cancelled =
        GenicamDriver(GenicamSettings { serial: "nobody".to_owned(), ..GenicamSettings::default() });
    let is_built = !matches!(never_cancelled.open(wanted), Err(OpenError::Settings { .. }));
    if !is_built {
        reference::without_feature("genicam", "the Debian packages libaravis-dev and libusb-1.0-0-dev");
    }
    is_built && reference::has_program(PROGRAM, "aravis-tools")
}

/// Starts a camera process that loses so many packets per thousand; `None`, with a note, if it cannot be tested here.
pub fn fake(lost_per_thousand: u32) -> Option<FakeCamera> {
    let options = FakeOptions { serial: SERIAL.to_owned(), lost_per_thousand, ..FakeOptions::default() };
    is_built().then(|| FakeCamera::start(options).expect("the camera process starts"))
}

/// The camera together with these devices.
pub fn devices(others: StationDevices) -> StationDevices {
    StationDevices { camera: Arc::new(driver()), ..others }
}

fn station(scenario: Scenario) -> Bench {
    let mut options = twin::TwinOptions::default();
    if scenario == Scenario::Homing {
        (options.timing, options.travel_mm) = (twin::Timing::Realistic, (-60.0, 60.0));
    }
    bench_of(devices(StationDevices::over(small_twin(options))))
}

/// Sets a small image, which a busy machine receives without loss.
pub fn set_small(bench: &Bench) {
    let roi = Roi { left_px: 16, top_px: 8, width_px: 128, height_px: 96 };
    let wanted = CameraRequest { roi: Some(roi), frame_rate_hz: Some(50.0), ..CameraRequest::default() };
    bench.manual(Manual::Configure(wanted)).unwrap();
}

fn genicam(scenario: Scenario, fault: InjectedFault, reaction: Reaction) {
    let lost_per_thousand = if fault == InjectedFault::LostPackets { LOST_PER_THOUSAND } else { 0 };
    let Some(camera) = fake(lost_per_thousand).map(RefCell::new) else { return };
    let controlled_elsewhere = RefCell::new(None);
    let inject = || match fault {
        InjectedFault::Unplugged => camera.borrow_mut().kill(),
        InjectedFault::Hang => camera.borrow().hold(),
        InjectedFault::Restart => camera.borrow_mut().restart().unwrap(),
        InjectedFault::LostPackets => {}
        InjectedFault::ControlledElsewhere => {
            let wanted = DeviceSet { camera: true, ..DeviceSet::default() };
            *controlled_elsewhere.borrow_mut() =
                Some(driver().open(wanted).unwrap_or_else(|error| panic!("{error}")));
        }
    };
    if scenario == Scenario::Absent {
        inject();
    }
    let bench = station(scenario);
    if scenario != Scenario::Absent {
        bench.wait_for("camera connected", |status| status.camera.connected);
        set_small(&bench);
    }
    let control = bench.control.clone();
    let clear = || {
        match fault {
            InjectedFault::Unplugged => camera.borrow_mut().restart().unwrap(),
            InjectedFault::Hang => camera.borrow().resume(),
            InjectedFault::Restart | InjectedFault::LostPackets => {}
            InjectedFault::ControlledElsewhere => drop(controlled_elsewhere.borrow_mut().take()),
        }
        // A camera that was suspended still assigns control to its previous owner for three seconds.
        for _ in 0..2 {
            if !matches!(bench.manual(Manual::Reset), Err(StationRefusal::InError { .. })) {
                return;
            }
        }
    };
    let motion = || {
        let before = control.true_position_mm();
        std::thread::sleep(Duration::from_millis(5));
        control.true_position_mm() != before
    };
    check(
        &Rig {
            bench: &bench,
            inject: &inject,
            clear: &clear,
            press_button: &|| panic!("this device has no reset button"),
            light: &|| control.laser_power() > 0.0,
            motion: &motion,
            stop_reaches_stage: true,
            report_limit: REPORT_LIMIT,
        },
        scenario,
        reaction,
    );
}

const DISCONNECTED: Reaction = Reported("camera", "disconnected");
/// In a sweep missing frames are a fault at once.
const SILENT_OR_DISCONNECTED: Reaction = ReportedEither("camera", ["silent", "disconnected"]);

cells! { genicam;
    unplugged: InjectedFault::Unplugged =>
        absent: DISCONNECTED, ready: DISCONNECTED, live: DISCONNECTED, scanning: SILENT_OR_DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
    hang: InjectedFault::Hang =>
        absent: DISCONNECTED, ready: DISCONNECTED, live: DISCONNECTED, scanning: SILENT_OR_DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
    restart: InjectedFault::Restart =>
        ready: DISCONNECTED, live: DISCONNECTED, scanning: SILENT_OR_DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
    lost_packets: InjectedFault::LostPackets =>
        absent: Continues, ready: Continues, live: Continues, scanning: Continues, calibrating: Continues, jogging: Continues,
        homing: Continues;
    controlled_elsewhere: InjectedFault::ControlledElsewhere => absent: DISCONNECTED;
}

/// As from a network card whose packets are smaller than the camera's: hardly any frame of 35 packets is complete.
#[test]
fn a_camera_whose_packets_are_lost_is_reported_with_the_packet_size_as_remedy() {
    let Some(_camera) = fake(300) else { return };
    let bench = station(Scenario::Live);
    bench.wait_for("camera connected", |status| status.camera.connected);
    wait(bench.station.live(LiveRequest { running: true, laser_power: 0.0 })).unwrap();
    bench.wait_for("in error", |status| status.state == MachineState::Error);
    let status = bench.station.status();
    let [fault] = &status.faults[..] else { panic!("{:?}", status.faults) };
    assert!(fault.detail.ends_with("were incomplete") && fault.remedy.contains("packet size"), "{fault:?}");
}
