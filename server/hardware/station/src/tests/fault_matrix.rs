//! The fault × state matrix over the simulated station; the table is in `server/docs/station.md`.

use std::time::Duration;

use devices::contract::Stopwatch;
use twin::TwinFault;

use super::bench::{bench, bench_of, nobody, small_devices, wait, wait_until};
use super::cell::Doing::{Calibrating, Jogging, Ready, Scanning};
use super::cell::Follows::{GoesOn, Named, NamedAtUse};
use super::cell::{Doing, Follows, Rig, check};
use crate::{MachineState, Manual, StationRefusal, Sweep};

fn cell(doing: Doing, fault: TwinFault, follows: Follows) {
    println!("{doing:?} × {fault}");
    let bench = bench();
    let control = bench.control.clone();
    let inject = || {
        control.set_fault(match fault {
            // In the way of whatever moves.
            TwinFault::StageStall { .. } if matches!(doing, Scanning | Jogging) => {
                TwinFault::StageStall { at_mm: control.true_position_mm() + 1.0 }
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
            cure: &|| assert!(control.clear_fault(fault.name()) || matches!(fault, TwinFault::LostSteps { .. })),
            light: &|| control.laser_power() > 0.0,
            motion: &motion,
            can_be_told: !matches!(fault, TwinFault::StageSilent | TwinFault::StageUnplugged),
        },
        doing,
        follows,
    );
}

macro_rules! cells {
    ($($name:ident: $fault:expr => $ready:expr, $scanning:expr, $calibrating:expr, $jogging:expr;)*) => {
        $(mod $name {
            use super::*;

            #[test]
            fn while_ready() {
                cell(Ready, $fault, $ready);
            }

            #[test]
            fn while_scanning() {
                cell(Scanning, $fault, $scanning);
            }

            #[test]
            fn while_calibrating() {
                cell(Calibrating, $fault, $calibrating);
            }

            #[test]
            fn while_jogging() {
                cell(Jogging, $fault, $jogging);
            }
        })*
    };
}

const CAMERA_GONE: Follows = Named("camera", "gone");
const WRONG_FRAME: Follows = Named("camera", "wrong_frame");
const SILENT: Follows = Named("camera", "silent");
const NO_REPLY: Follows = Named("stage", "no_reply");
const STAGE_GONE: Follows = Named("stage", "gone");
const STALLED: Follows = Named("stage", "stalled");
const LASER_FAULT: Follows = Named("laser", "fault");
const LASER_GONE: Follows = Named("laser", "gone");
const INTERLOCK: Follows = Named("laser", "interlock_open");

cells! {
    camera_unplugged: TwinFault::CameraUnplugged => CAMERA_GONE, CAMERA_GONE, CAMERA_GONE, CAMERA_GONE;
    camera_hang: TwinFault::CameraHang => NamedAtUse("camera", "silent"), SILENT, SILENT, GoesOn;
    wrong_frame_size: TwinFault::WrongFrameSize =>
        NamedAtUse("camera", "wrong_frame"), WRONG_FRAME, WRONG_FRAME, GoesOn;
    wrong_pixel_format: TwinFault::WrongPixelFormat =>
        NamedAtUse("camera", "wrong_frame"), WRONG_FRAME, WRONG_FRAME, GoesOn;
    stage_silent: TwinFault::StageSilent => NO_REPLY, NO_REPLY, NO_REPLY, NO_REPLY;
    stage_unplugged: TwinFault::StageUnplugged => STAGE_GONE, STAGE_GONE, STAGE_GONE, STAGE_GONE;
    stage_stall: TwinFault::StageStall { at_mm: 5.0 } => NamedAtUse("stage", "stalled"), STALLED, STALLED, STALLED;
    lost_steps: TwinFault::LostSteps { lost_mm: 0.5 } => GoesOn, GoesOn, GoesOn, GoesOn;
    laser_fault: TwinFault::LaserFault => LASER_FAULT, LASER_FAULT, LASER_FAULT, LASER_FAULT;
    laser_unplugged: TwinFault::LaserUnplugged => LASER_GONE, LASER_GONE, LASER_GONE, LASER_GONE;
    interlock_open: TwinFault::InterlockOpen => GoesOn, INTERLOCK, INTERLOCK, GoesOn;
    lost_frames: TwinFault::LostFrames { every: 4 } => GoesOn, GoesOn, GoesOn, GoesOn;
}

#[test]
fn absent_devices_are_named_at_the_start_and_come_with_a_reset() {
    let absent = [
        (TwinFault::CameraUnplugged, "camera", "gone"),
        (TwinFault::StageUnplugged, "stage", "gone"),
        (TwinFault::StageSilent, "stage", "no_reply"),
        (TwinFault::LaserUnplugged, "laser", "gone"),
        (TwinFault::LaserFault, "laser", "fault"),
    ];
    // At the same time: each waits out a reset that cannot succeed.
    std::thread::scope(|scope| {
        for (fault, device, kind) in absent {
            scope.spawn(move || comes_with_a_reset(fault, device, kind));
        }
    });
}

/// A station whose device is absent from the start.
fn comes_with_a_reset(fault: TwinFault, device: &str, kind: &str) {
    let devices = small_devices();
    devices.twin.as_ref().unwrap().control().unwrap().set_fault(fault);
    let watch = Stopwatch::start();
    let bench = bench_of(devices);
    bench.wait_for("named", |status| {
        status.faults.iter().any(|fault| (fault.device, fault.kind) == (device, kind))
    });
    let took = watch.own_time();
    assert!(took <= Duration::from_secs(2), "{fault} was named after {took:?}");
    bench.wait_for("in error", |status| status.state == MachineState::Error);
    assert!(matches!(bench.try_lease().map(drop), Err(StationRefusal::InError { .. })), "{fault}");
    assert!(matches!(bench.manual(Manual::Reset), Err(StationRefusal::InError { .. })), "{fault}");
    assert_eq!(bench.control.laser_power(), 0.0);
    bench.control.clear_fault(fault.name());
    bench.manual(Manual::Reset).unwrap();
    bench.wait_for("reached", |status| matches!(status.state, MachineState::Operational(_)));
}

#[test]
fn frames_lost_in_a_scan_are_counted_while_it_runs() {
    let bench = bench();
    bench.control.set_fault(TwinFault::LostFrames { every: 4 });
    let lease = bench.lease();
    let sweep = Sweep { from_mm: 0.0, to_mm: 20.0, speed_mm_s: 20.0, frame_rate_hz: 100.0 };
    let stream = lease.sweep(&sweep, &nobody()).unwrap();
    let frames: Vec<_> = stream.frames.iter().collect();
    assert!(stream.broken().is_none());
    // The first frame's losses lie before it, and so perhaps outside of the range.
    let gaps: u64 = frames.iter().skip(1).map(|frame| frame.lost_before).sum();
    let dropped = stream.dropped.total();
    assert!(gaps > 0 && (gaps..=gaps + 2).contains(&dropped), "{gaps} in gaps, {dropped} counted");
    // The station counts what was lost on the way to the range, too.
    let is_counted = |(reason, n): &(&str, u64)| *reason == "camera" && *n >= dropped;
    bench.wait_for("counted", |status| status.frames_dropped.iter().any(is_counted));
}

#[test]
fn lost_steps_are_not_noticed_by_the_station_and_found_by_homing() {
    let bench = bench();
    let lease = bench.lease();
    lease.move_to(10.0, None, &nobody()).unwrap();
    bench.control.set_fault(TwinFault::LostSteps { lost_mm: 0.5 });
    let frame = lease.grab(&nobody()).unwrap();
    assert_eq!(frame.position_mm, Some(10.0), "the controller believes it; only a measurement can tell");
    assert!((bench.control.true_position_mm() - 9.5).abs() < 1e-9);
    drop(lease);
    bench.manual(Manual::Home).unwrap();
    bench.wait_for("homed", |status| !status.moving);
    bench.lease().move_to(10.0, None, &nobody()).unwrap();
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
    wait_until("dark", || bench.control.laser_power() == 0.0);
    assert!(matches!(bench.manual(Manual::Reset), Err(StationRefusal::InError { .. })));
    assert!(bench.station.is_halted(), "a reset that did not reach the camera does not end the Stop");
    bench.control.clear_fault("camera_unplugged");
    bench.manual(Manual::Reset).unwrap();
    bench.wait_for("ready", |status| status.activity == "ready");
    assert!(!bench.station.is_halted());
}
