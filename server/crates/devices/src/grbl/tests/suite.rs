//! The suite every stage and laser passes.

use std::sync::Arc;
use std::time::Duration;

use super::{Bench, bench, sound_bench};
use crate::contract::{self, Cable, LaserProfile, StageProfile};
use crate::grbl_simulator::SimulatorConfig;

#[test]
fn the_stage_passes_the_suite() {
    let bench = sound_bench();
    contract::stage(&mut || Box::new(bench.open().0), &stage_profile(&bench));
}

#[test]
fn a_stage_without_switches_passes_the_suite() {
    let bench = bench(SimulatorConfig { homing: false, soft_limits: false, ..SimulatorConfig::default() });
    contract::stage(&mut || Box::new(bench.open().0), &stage_profile(&bench));
}

#[test]
fn a_stage_of_grbl_hal_against_the_machine_s_direction_passes_the_suite() {
    let mut bench = bench(SimulatorConfig {
        banner: "GrblHAL 1.1f ['$' or '$HELP' for help]".into(),
        grbl_hal: true,
        axis: 'Y',
        ..SimulatorConfig::default()
    });
    (bench.config.axis, bench.config.reversed) = (crate::grbl::Axis::Y, true);
    contract::stage(&mut || Box::new(bench.open().0), &stage_profile(&bench));
}

#[test]
fn the_laser_passes_the_suite() {
    let bench = sound_bench();
    let witness = bench.simulator.witness().clone();
    let profile = LaserProfile {
        light: Some(Box::new(move || witness.light())),
        // `promises.md` 3: dark within 0.5 s.
        reaction_limit: Duration::from_millis(500),
        cable: Some(cable(&bench)),
    };
    contract::laser(&mut || Box::new(bench.open().1), &profile);
}

fn stage_profile(bench: &Bench) -> StageProfile {
    StageProfile {
        speed_mm_s: 20.0,
        // Half a step, and the last decimal of a report.
        tolerance_mm: 0.5 / super::STEPS_PER_MM + 0.001,
        instant: false,
        motion_limit: Duration::from_secs(2),
        rest_limit: Duration::from_millis(300),
        cable: Some(cable(bench)),
    }
}

fn cable(bench: &Bench) -> Cable {
    let (unplugged, replugged) = (Arc::clone(&bench.simulator), Arc::clone(&bench.simulator));
    Cable { unplug: Box::new(move || unplugged.unplug()), replug: Box::new(move || replugged.replug()) }
}
