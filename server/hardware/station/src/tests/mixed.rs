//! Stations with devices of several drivers; each is opened separately, and one that hangs does not delay the others.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use devices::grbl::{GrblDriver, GrblSettings};
use devices::grbl_simulator::{GrblSimulator, SimulatorConfig};
use devices::replay::{ReplayDriver, ReplaySettings};
use tempfile::TempDir;

use super::bench::{bench_of, never_cancelled, small_devices, wait, wait_until};
use super::spy_camera::spied;
use crate::params::OPENING_LIMIT;
use crate::{MachineState, Manual, StationDevices};

/// A controller whose axis is unused: without limit switches, so that it accepts commands at once.
fn controller() -> (GrblSimulator, Arc<GrblDriver>, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let machine = SimulatorConfig { homing: false, ..SimulatorConfig::default() };
    let settings = GrblSettings { steps_per_mm: machine.steps_per_mm, ..GrblSettings::default() };
    let controller = GrblSimulator::start(machine, &folder.path().join("tty"), None).unwrap();
    let port = controller.port_name().display().to_string();
    (controller, Arc::new(GrblDriver(GrblSettings { port, ..settings })), folder)
}

#[test]
fn a_laser_on_a_controller_illuminates_the_simulated_scene_with_a_simulated_stage() {
    let (controller, grbl, _folder) = controller();
    let bench = bench_of(StationDevices { laser: grbl, ..small_devices() });
    bench.wait_for("ready", |status| status.activity == "ready");
    let lease = bench.lease();
    lease.move_to(10.0, None, &never_cancelled()).unwrap();
    assert_eq!(bench.control.true_position_mm(), 10.0);
    lease.laser_on(1.0).unwrap();
    assert!(lease.grab(&never_cancelled()).unwrap().laser_on);
    assert!(controller.event_log().light() && bench.control.laser_power() > 0.0);
    drop(lease);
    wait_until("laser off", || !controller.event_log().light() && bench.control.laser_power() == 0.0);
    assert_eq!(controller.event_log().n_motions_since(controller.event_log().mark()), 0);
}

#[test]
fn a_stage_on_a_controller_moves_the_simulated_scene_with_a_simulated_laser() {
    let (controller, grbl, _folder) = controller();
    let bench = bench_of(StationDevices { stage: grbl, ..small_devices() });
    // Homing zeroes at the present position, at the upper end of the travel.
    bench.manual(Manual::Home).unwrap();
    bench.wait_for("ready", |status| status.activity == "ready");
    let lease = bench.lease();
    lease.move_to(-10.0, None, &never_cancelled()).unwrap();
    lease.laser_on(1.0).unwrap();
    let frame = lease.grab(&never_cancelled()).unwrap();
    assert!(frame.laser_on && (frame.position_mm.unwrap() + 10.0).abs() < 0.01, "{:?}", frame.position_mm);
    assert!((bench.control.true_position_mm() + 10.0).abs() < 0.01);
    assert!(bench.control.laser_power() > 0.0 && !controller.event_log().light());
}

#[test]
fn a_driver_that_cannot_open_keeps_only_its_own_devices() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = ReplaySettings { folder: folder.path().join("nowhere"), ..ReplaySettings::default() };
    let bench = bench_of(StationDevices { laser: Arc::new(ReplayDriver(nowhere)), ..small_devices() });
    let status = bench.station.status();
    assert_eq!(status.state, MachineState::Preoperational);
    let named: Vec<_> = status.faults.iter().map(|fault| (fault.device, fault.kind)).collect();
    assert_eq!(named, [("laser", "disconnected")]);
    assert!(status.camera.connected && status.stage.connected && !status.laser.connected);
}

#[test]
fn a_driver_that_hangs_while_it_opens_is_reported_and_stop_works_anyway() {
    let (devices, spy) = spied(small_devices());
    let hang = OPENING_LIMIT + Duration::from_secs(1);
    spy.open_hang_ms.store(hang.as_millis() as u64, Ordering::SeqCst);
    let begun = Instant::now();
    let bench = bench_of(devices);
    bench.wait_for("fault reported", |status| {
        status.faults.iter().any(|fault| (fault.device, fault.kind) == ("camera", "opening"))
    });
    let status = bench.station.status();
    assert!(
        begun.elapsed() < hang && status.stage.connected && status.laser.connected && !status.camera.connected
    );
    let requested = Instant::now();
    wait(bench.station.stop("a person")).unwrap();
    assert!(requested.elapsed() < Duration::from_millis(500), "reported after {:?}", requested.elapsed());
    bench.wait_for("camera connected", |status| status.camera.connected && status.faults.is_empty());
    bench.manual(Manual::Reset).unwrap();
    bench.wait_for("ready", |status| status.activity == "ready");
}
