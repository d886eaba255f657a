//! A conveyor beside the simulated camera and laser.

use twin::TwinFault;

use super::cell::Reaction::{self, EndsScan, GoesOn, Named};
use super::cell::{NAMED, Rig, Scenario, cells, check};
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
            cure: &|| assert!(control.clear_fault(fault.name())),
            press_button: &|| panic!("it has none"),
            light: &|| control.laser_power() > 0.0,
            // The belt is not this station's.
            motion: &|| false,
            can_be_told: false,
            named_within: NAMED,
        },
        scenario,
        reaction,
    );
}

const CAMERA_GONE: Reaction = Named("camera", "gone");
const LASER_FAULT: Reaction = Named("laser", "fault");

cells! { cell;
    belt_stops: TwinFault::BeltStops => absent: GoesOn, ready: GoesOn, live: GoesOn, scanning: EndsScan;
    lost_triggers: TwinFault::LostFrames { every: 4 } => absent: GoesOn, ready: GoesOn, live: GoesOn, scanning: GoesOn;
    camera_unplugged: TwinFault::CameraUnplugged =>
        absent: CAMERA_GONE, ready: CAMERA_GONE, live: CAMERA_GONE, scanning: CAMERA_GONE;
    laser_fault: TwinFault::LaserFault =>
        absent: LASER_FAULT, ready: LASER_FAULT, live: LASER_FAULT, scanning: LASER_FAULT;
}
