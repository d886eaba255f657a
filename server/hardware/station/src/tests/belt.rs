//! A belt whose encoder triggers the camera: positions are counted, and the station does not command it.

use std::sync::Arc;

use devices::conveyor::{ConveyorDriver, ConveyorSettings};
use devices::{CameraRequest, StageError, Trigger};
use remedy::Remedy as _;
use twin::TwinFault;

use super::bench::{Bench, bench_of, never_cancelled, small_devices, wait, wait_until};
use crate::{LaserLight, MachineState, Manual, StationDevices, StationRefusal, Sweep};

/// Travel between two triggers of these tests.
const PITCH_MM: f64 = 0.25;

const SWEEP: Sweep = Sweep { from_mm: 0.0, to_mm: 10.0, speed_mm_s: 12.5, frame_rate_hz: 50.0 };

/// A small simulated station whose parts come on a belt.
pub fn belt_devices() -> StationDevices {
    let settings = ConveyorSettings { pitch_mm: PITCH_MM, longest_mm: 100.0 };
    StationDevices { stage: Arc::new(ConveyorDriver(settings)), ..small_devices() }
}

fn belt() -> Bench {
    let bench = bench_of(belt_devices());
    bench.wait_for("ready", |status| status.activity == "ready");
    let fast = CameraRequest { frame_rate_hz: Some(50.0), ..CameraRequest::default() };
    bench.manual(Manual::Configure(fast)).unwrap();
    bench
}

/// Positions of the frames of a scan, and how many were lost within it.
fn scanned(bench: &Bench) -> (Vec<f64>, u64) {
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let stream = lease.sweep(&SWEEP, &never_cancelled()).unwrap();
    let frames: Vec<_> = stream.frames.iter().collect();
    assert!(stream.end_reason().is_none());
    assert!(frames.iter().all(|frame| frame.laser_on));
    (frames.iter().map(|frame| frame.position_mm.unwrap()).collect(), stream.dropped.total())
}

#[test]
fn a_position_is_the_number_of_triggers_and_each_scan_counts_anew() {
    let bench = belt();
    for _ in 0..2 {
        let (positions, lost) = scanned(&bench);
        // A busy machine may lose frames of the simulated camera; they are counted.
        assert_eq!(positions.len() as u64 + lost, 41, "{positions:?}");
        assert!(positions.iter().all(|at| (at / PITCH_MM).fract() == 0.0), "{positions:?}");
        assert_eq!(positions[0], 0.0);
    }
    let status = bench.station.status();
    assert_eq!(status.camera_settings.trigger, Trigger::Free, "the trigger is restored");
    assert_eq!(status.laser_light, LaserLight::Off);
}

#[test]
fn a_lost_frame_moves_the_position_by_as_many_steps_and_is_counted() {
    let bench = belt();
    bench.control.set_fault(TwinFault::LostFrames { every: 7 });
    let (positions, lost) = scanned(&bench);
    let steps: Vec<i64> = positions.iter().map(|at| (at / PITCH_MM).round() as i64).collect();
    assert!(positions.iter().zip(&steps).all(|(at, step)| *at == *step as f64 * PITCH_MM), "{positions:?}");
    let missing = (0..=40).filter(|step| !steps.contains(step)).count() as u64;
    assert_eq!((lost, positions.len() as u64 + lost), (missing, 41), "{steps:?}");
    assert!(missing >= 5, "{steps:?}");
}

#[test]
fn commands_to_the_belt_are_refused_by_name_and_are_not_a_fault() {
    let bench = belt();
    let commands =
        [Manual::Home, Manual::Move { target_mm: 5.0, speed_mm_s: None }, Manual::Jog { velocity_mm_s: 5.0 }];
    for command in commands {
        let refusal = bench.manual(command).unwrap_err();
        assert!(matches!(refusal, StationRefusal::Stage(StageError::NotCommanded { .. })), "{refusal:?}");
        assert!(refusal.remedy().unwrap().contains("own controls"));
    }
    let lease = bench.lease();
    assert!(lease.move_to(5.0, None, &never_cancelled()).is_err());
    assert!(lease.home(&never_cancelled()).is_err());
    let backwards = Sweep { from_mm: 10.0, to_mm: 0.0, ..SWEEP };
    assert!(lease.sweep(&backwards, &never_cancelled()).is_err());
    drop(lease);
    assert_eq!(bench.station.status().faults, []);
    assert!(!scanned(&bench).0.is_empty());
}

#[test]
fn a_stopped_belt_is_awaited_with_the_laser_off_and_ends_a_running_scan() {
    let bench = belt();
    bench.control.set_fault(TwinFault::ConveyorStopped);
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let stream = lease.sweep(&SWEEP, &never_cancelled()).unwrap();
    wait_until("laser off while it waits", || bench.control.laser_power() == 0.0);
    bench.control.clear_fault(TwinFault::ConveyorStopped.name());
    let first = stream.frames.recv().unwrap();
    assert_eq!((first.position_mm, first.laser_on), (Some(0.0), true));
    bench.control.set_fault(TwinFault::ConveyorStopped);
    while stream.frames.recv().is_ok() {}
    let end_reason = stream.end_reason();
    assert!(matches!(end_reason, Some(StationRefusal::BeltStopped { .. })), "{end_reason:?}");
    wait_until("laser off", || bench.control.laser_power() == 0.0);
    drop(lease);
    assert_eq!(bench.station.status().faults, [], "a stopped belt is not a fault of the station");
}

#[test]
fn stop_turns_the_laser_off_and_ends_the_scan_while_the_belt_continues() {
    let bench = belt();
    let lease = bench.lease();
    lease.laser_on(1.0).unwrap();
    let long = Sweep { to_mm: 100.0, ..SWEEP };
    let stream = lease.sweep(&long, &never_cancelled()).unwrap();
    stream.frames.recv().unwrap();
    wait(bench.station.stop("a person")).unwrap();
    assert_eq!((bench.control.laser_power(), bench.station.status().state), (0.0, MachineState::Halted));
    while stream.frames.recv().is_ok() {}
    assert!(matches!(stream.end_reason(), Some(StationRefusal::Stopped { .. })));
}
