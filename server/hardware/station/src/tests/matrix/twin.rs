//! The simulated station.

use std::time::Duration;

use twin::{Timing, TwinFault, TwinOptions};

use super::cell::Reaction::{self, Continues, Reported, ReportedAtUse};
use super::cell::{REPORT_LIMIT, Rig, Scenario, cells, check};
use crate::tests::bench::{Bench, bench, bench_of, never_cancelled, small_twin, wait, wait_until};
use crate::{MachineState, Manual, StationDevices, StationRefusal, Sweep};

/// A small simulated station with realistic timing that is not homed.
fn slow_bench() -> Bench {
    let options = TwinOptions { timing: Timing::Realistic, travel_mm: (-60.0, 60.0), ..TwinOptions::default() };
    bench_of(StationDevices::over(small_twin(options)))
}

fn cell(scenario: Scenario, fault: TwinFault, reaction: Reaction) {
    let bench = match scenario {
        Scenario::Homing => slow_bench(),
        Scenario::Absent => {
            let devices = crate::tests::bench::small_devices();
            devices.twin.as_ref().unwrap().control().unwrap().set_fault(fault);
            bench_of(devices)
        }
        _ => bench(),
    };
    let control = bench.control.clone();
    let inject = || {
        control.set_fault(match fault {
            // Blocks the motion; homing moves downwards.
            TwinFault::StageStall { .. } if matches!(scenario, Scenario::Scanning | Scenario::Jogging) => {
                TwinFault::StageStall { at_mm: control.true_position_mm() + 1.0 }
            }
            TwinFault::StageStall { .. } if scenario == Scenario::Homing => {
                TwinFault::StageStall { at_mm: control.true_position_mm() - 1.0 }
            }
            other => other,
        });
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
            clear: &|| assert!(control.clear_fault(fault.name()) || matches!(fault, TwinFault::LostSteps { .. })),
            press_button: &|| panic!("this device has no reset button"),
            light: &|| control.laser_power() > 0.0,
            motion: &motion,
            stop_reaches_stage: !matches!(fault, TwinFault::StageSilent | TwinFault::StageUnplugged),
            report_limit: REPORT_LIMIT,
        },
        scenario,
        reaction,
    );
}

const CAMERA_DISCONNECTED: Reaction = Reported("camera", "disconnected");
const WRONG_FRAME: Reaction = Reported("camera", "wrong_frame");
const SILENT_AT_USE: Reaction = ReportedAtUse("camera", "silent");
const WRONG_AT_USE: Reaction = ReportedAtUse("camera", "wrong_frame");
const STALLED_AT_USE: Reaction = ReportedAtUse("stage", "stalled");
const SILENT: Reaction = Reported("camera", "silent");
const NO_RESPONSE: Reaction = Reported("stage", "no_response");
const STAGE_DISCONNECTED: Reaction = Reported("stage", "disconnected");
const STALLED: Reaction = Reported("stage", "stalled");
const LASER_FAULT: Reaction = Reported("laser", "fault");
const LASER_DISCONNECTED: Reaction = Reported("laser", "disconnected");
const INTERLOCK: Reaction = Reported("laser", "interlock_open");

cells! { cell;
    camera_unplugged: TwinFault::CameraUnplugged =>
        absent: CAMERA_DISCONNECTED, ready: CAMERA_DISCONNECTED, live: CAMERA_DISCONNECTED, scanning: CAMERA_DISCONNECTED, calibrating: CAMERA_DISCONNECTED,
        jogging: CAMERA_DISCONNECTED, homing: CAMERA_DISCONNECTED;
    camera_hang: TwinFault::CameraHang =>
        absent: SILENT_AT_USE, ready: SILENT_AT_USE, live: SILENT, scanning: SILENT, calibrating: SILENT,
        jogging: Continues, homing: Continues;
    wrong_frame_size: TwinFault::WrongFrameSize =>
        absent: WRONG_AT_USE, ready: WRONG_AT_USE, live: WRONG_FRAME, scanning: WRONG_FRAME, calibrating: WRONG_FRAME,
        jogging: Continues, homing: Continues;
    wrong_pixel_format: TwinFault::WrongPixelFormat =>
        absent: WRONG_AT_USE, ready: WRONG_AT_USE, live: WRONG_FRAME, scanning: WRONG_FRAME, calibrating: WRONG_FRAME,
        jogging: Continues, homing: Continues;
    lost_frames: TwinFault::LostFrames { every: 4 } =>
        absent: Continues, ready: Continues, live: Continues, scanning: Continues, calibrating: Continues, jogging: Continues,
        homing: Continues;
    stage_silent: TwinFault::StageSilent =>
        absent: NO_RESPONSE, ready: NO_RESPONSE, live: NO_RESPONSE, scanning: NO_RESPONSE, calibrating: NO_RESPONSE,
        jogging: NO_RESPONSE, homing: NO_RESPONSE;
    stage_unplugged: TwinFault::StageUnplugged =>
        absent: STAGE_DISCONNECTED, ready: STAGE_DISCONNECTED, live: STAGE_DISCONNECTED, scanning: STAGE_DISCONNECTED, calibrating: STAGE_DISCONNECTED,
        jogging: STAGE_DISCONNECTED, homing: STAGE_DISCONNECTED;
    stage_stall: TwinFault::StageStall { at_mm: 5.0 } =>
        absent: STALLED_AT_USE, ready: STALLED_AT_USE, live: STALLED_AT_USE, scanning: STALLED, calibrating: STALLED,
        jogging: STALLED, homing: STALLED;
    lost_steps: TwinFault::LostSteps { lost_mm: 0.5 } =>
        absent: Continues, ready: Continues, live: Continues, scanning: Continues, calibrating: Continues, jogging: Continues,
        homing: Continues;
    laser_fault: TwinFault::LaserFault =>
        absent: LASER_FAULT, ready: LASER_FAULT, live: LASER_FAULT, scanning: LASER_FAULT, calibrating: LASER_FAULT,
        jogging: LASER_FAULT, homing: LASER_FAULT;
    laser_unplugged: TwinFault::LaserUnplugged =>
        absent: LASER_DISCONNECTED, ready: LASER_DISCONNECTED, live: LASER_DISCONNECTED, scanning: LASER_DISCONNECTED, calibrating: LASER_DISCONNECTED,
        jogging: LASER_DISCONNECTED, homing: LASER_DISCONNECTED;
    interlock_open: TwinFault::InterlockOpen =>
        absent: Continues, ready: Continues, live: INTERLOCK, scanning: INTERLOCK, calibrating: INTERLOCK, jogging: Continues,
        homing: Continues;
}

#[test]
fn frames_lost_in_a_scan_are_counted_while_it_runs() {
    let bench = bench();
    bench.control.set_fault(TwinFault::LostFrames { every: 4 });
    let lease = bench.lease();
    let sweep = Sweep { from_mm: 0.0, to_mm: 20.0, speed_mm_s: 20.0, frame_rate_hz: 100.0 };
    let stream = lease.sweep(&sweep, &never_cancelled()).unwrap();
    let frames: Vec<_> = stream.frames.iter().collect();
    assert!(stream.end_reason().is_none());
    // The losses of the first frame lie before it, and so possibly outside of the range.
    let gaps: u64 = frames.iter().skip(1).map(|frame| frame.lost_before).sum();
    let dropped = stream.dropped.total();
    assert!(gaps > 0 && (gaps..=gaps + 2).contains(&dropped), "{gaps} in gaps, {dropped} counted");
    // The station also counts losses before the range.
    let is_counted = |(reason, n): &(&str, u64)| *reason == "camera" && *n >= dropped;
    bench.wait_for("counted", |status| status.frames_dropped.iter().any(is_counted));
}

#[test]
fn lost_steps_are_not_detected_by_the_station_and_corrected_by_homing() {
    let bench = bench();
    let lease = bench.lease();
    lease.move_to(10.0, None, &never_cancelled()).unwrap();
    bench.control.set_fault(TwinFault::LostSteps { lost_mm: 0.5 });
    let frame = lease.grab(&never_cancelled()).unwrap();
    assert_eq!(frame.position_mm, Some(10.0), "the controller does not notice; only a measurement can show it");
    assert!((bench.control.true_position_mm() - 9.5).abs() < 1e-9);
    drop(lease);
    bench.manual(Manual::Home).unwrap();
    bench.wait_for("homed", |status| !status.moving);
    bench.lease().move_to(10.0, None, &never_cancelled()).unwrap();
    assert!((bench.control.true_position_mm() - 10.0).abs() < 1e-9);
}

#[test]
fn an_open_interlock_is_shown_and_refuses_light() {
    let bench = bench();
    bench.control.set_fault(TwinFault::InterlockOpen);
    bench.wait_for("shown", |status| status.interlock_closed == Some(false) && status.faults.is_empty());
    let lease = bench.lease();
    assert!(matches!(lease.laser_on(1.0), Err(StationRefusal::Laser(devices::LaserError::InterlockOpen))));
    assert_eq!(bench.control.laser_power(), 0.0);
    drop(lease);
    bench.control.clear_fault("interlock_open");
    bench.wait_for("closed", |status| status.interlock_closed == Some(true));
    bench.manual(Manual::Reset).unwrap();
    bench.lease().laser_on(1.0).unwrap();
}

#[test]
fn a_stop_in_error_is_taken_and_the_fault_stays_for_the_reset() {
    let bench = bench();
    bench.control.set_fault(TwinFault::CameraUnplugged);
    bench.wait_for("in error", |status| status.state == MachineState::Error);
    wait(bench.station.stop("a person")).unwrap();
    let status = bench.station.status();
    assert_eq!((status.state, status.faults.len()), (MachineState::Halted, 1));
    wait_until("laser off", || bench.control.laser_power() == 0.0);
    assert!(matches!(bench.manual(Manual::Reset), Err(StationRefusal::InError { .. })));
    assert!(bench.station.is_halted(), "a reset that did not reach the camera does not end the Stop");
    bench.control.clear_fault("camera_unplugged");
    bench.manual(Manual::Reset).unwrap();
    bench.wait_for("ready", |status| status.activity == "ready");
    assert!(!bench.station.is_halted());
}
