//! The contract suite of stage and laser.

use std::sync::Arc;
use std::time::Duration;

use super::{Bench, bench, bench_in_real_time};
use crate::contract::{self, Cable, LaserProfile, StageProfile};
use crate::simulators::grbl_simulator::{Dialect, SimulatorConfig};

fn stage_of(dialect: Dialect) {
    passes_as_stage(&bench(SimulatorConfig::of(dialect)), dialect);
}

fn passes_as_stage(bench: &Bench, dialect: Dialect) {
    contract::stage(&mut || Box::new(bench.open().0), &stage_profile(bench, dialect));
}

fn laser_of(dialect: Dialect) {
    passes_as_laser(&bench(SimulatorConfig::of(dialect)));
}

fn passes_as_laser(bench: &Bench) {
    let event_log = bench.simulator.event_log().clone();
    let profile = LaserProfile {
        light: Some(Box::new(move || event_log.light())),
        // `promises.md` 3: off within 0.5 s.
        reaction_limit: Duration::from_millis(500),
        cable: Some(cable(bench)),
    };
    contract::laser(&mut || Box::new(bench.open().1), &profile);
}

#[test]
fn the_stage_of_grbl_passes_the_suite() {
    stage_of(Dialect::Grbl);
}

#[test]
fn stage_and_laser_pass_the_suite_in_real_time() {
    let bench = bench_in_real_time(SimulatorConfig::default());
    passes_as_stage(&bench, Dialect::Grbl);
    passes_as_laser(&bench);
}

#[test]
fn the_stage_of_grbl_hal_passes_the_suite() {
    stage_of(Dialect::GrblHal);
}

#[test]
fn the_stage_of_fluid_nc_passes_the_suite() {
    stage_of(Dialect::FluidNc);
}

#[test]
fn the_laser_of_grbl_passes_the_suite() {
    laser_of(Dialect::Grbl);
}

#[test]
fn the_laser_of_grbl_hal_passes_the_suite() {
    laser_of(Dialect::GrblHal);
}

#[test]
fn the_laser_of_fluid_nc_passes_the_suite() {
    laser_of(Dialect::FluidNc);
}

#[test]
fn a_stage_without_switches_passes_the_suite() {
    let bench = bench(SimulatorConfig { homing: false, soft_limits: false, ..SimulatorConfig::default() });
    passes_as_stage(&bench, Dialect::Grbl);
}

#[test]
fn a_stage_against_the_machine_s_direction_passes_the_suite() {
    let mut bench = bench(SimulatorConfig { axis: 'Y', ..SimulatorConfig::of(Dialect::GrblHal) });
    (bench.config.axis, bench.config.reversed) = (crate::drivers::grbl::Axis::Y, true);
    passes_as_stage(&bench, Dialect::GrblHal);
}

#[test]
fn a_stage_that_is_locked_until_it_is_homed_passes_the_suite() {
    let bench = bench(SimulatorConfig { homing_lock: true, ..SimulatorConfig::of(Dialect::GrblHal) });
    passes_as_stage(&bench, Dialect::GrblHal);
}

fn stage_profile(bench: &Bench, dialect: Dialect) -> StageProfile {
    // A stopped homing is an alarm, followed by the pause.
    let alarm_pause = Duration::from_millis(if dialect == Dialect::GrblHal { 100 } else { 500 });
    StageProfile {
        speed_mm_s: 20.0,
        // Half a step, and the last decimal of a report.
        tolerance_mm: 0.5 / super::STEPS_PER_MM + 0.001,
        instant: false,
        motion_limit: Duration::from_secs(2),
        rest_limit: Duration::from_millis(300) + alarm_pause,
        reset_button: None,
        cable: Some(cable(bench)),
    }
}

fn cable(bench: &Bench) -> Cable {
    let (unplugged, replugged) = (Arc::clone(&bench.simulator), Arc::clone(&bench.simulator));
    Cable { unplug: Box::new(move || unplugged.unplug()), replug: Box::new(move || replugged.replug()) }
}
