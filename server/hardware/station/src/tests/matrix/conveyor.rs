//! A conveyor beside the simulated camera and laser.

use twin::TwinFault;

use super::cell::Reaction::{self, Continues, EndsScan, Reported};
use super::cell::{REPORT_LIMIT, Rig, Scenario, cells, check};
use crate::tests::belt::belt_devices;
use crate::tests::bench::bench_of;

fn cell(scenario: Scenario, fault: TwinFault, reaction: Reaction) {
    let devices = belt_devices();
    let control = devices.twin.as_ref().unwrap().control().unwrap();
    if scenario == Scenario::Absent {
        control.set_fault(fault);
    }
    let bench = bench_of(devices);
    if scenario != Scenario::Absent {
        bench.wait_for("ready", |status| status.activity == "ready");
    }
    check(
        &Rig {
            bench: &bench,
            inject: &|| control.set_fault(fault),
            clear: &|| assert!(control.clear_fault(fault.name())),
            press_button: &|| panic!("this device has no reset button"),
            light: &|| control.laser_power() > 0.0,
            // The belt is not this station's.
            motion: &|| false,
            stop_reaches_stage: false,
            report_limit: REPORT_LIMIT,
        },
        scenario,
        reaction,
    );
}

const CAMERA_DISCONNECTED: Reaction = Reported("camera", "disconnected");
const LASER_FAULT: Reaction = Reported("laser", "fault");

cells! { cell;
    conveyor_stopped: TwinFault::ConveyorStopped => absent: Continues, ready: Continues, live: Continues, scanning: EndsScan;
    lost_triggers: TwinFault::LostFrames { every: 4 } => absent: Continues, ready: Continues, live: Continues, scanning: Continues;
    camera_unplugged: TwinFault::CameraUnplugged =>
        absent: CAMERA_DISCONNECTED, ready: CAMERA_DISCONNECTED, live: CAMERA_DISCONNECTED, scanning: CAMERA_DISCONNECTED;
    laser_fault: TwinFault::LaserFault =>
        absent: LASER_FAULT, ready: LASER_FAULT, live: LASER_FAULT, scanning: LASER_FAULT;
}
