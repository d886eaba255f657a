//! The contract suite of stage and laser.

use std::sync::Arc;
use std::time::Duration;

use super::{Bench, RUN_OUT, bench, default_bench};
use crate::contract::{self, Cable, LaserProfile, StageProfile};
use crate::simulators::marlin_simulator::{Event, SimulatorConfig};

fn cable(bench: &Bench) -> Cable {
    let (unplugged, replugged) = (Arc::clone(&bench.simulator), Arc::clone(&bench.simulator));
    Cable { unplug: Box::new(move || unplugged.unplug()), replug: Box::new(move || replugged.replug()) }
}

fn profile(bench: &Bench) -> StageProfile {
    let simulator = Arc::clone(&bench.simulator);
    StageProfile {
        speed_mm_s: 8.0,
        // Two steps, by which a report and the driver may differ.
        tolerance_mm: 2.0 / bench.config.steps_per_mm,
        instant: false,
        motion_limit: Duration::from_secs(3),
        rest_limit: RUN_OUT,
        reset_button: Some(Box::new(move || simulator.trigger_event(Event::ResetButton))),
        cable: Some(cable(bench)),
    }
}

fn stage_of(bench: &Bench) {
    contract::stage(&mut || Box::new(bench.open().0), &profile(bench));
}

#[test]
fn a_marlin_stage_passes_the_suite() {
    stage_of(&default_bench());
}

#[test]
fn a_stage_on_y_against_the_machine_with_advanced_ok_passes_the_suite() {
    let kind = SimulatorConfig { axis: 'Y', advanced_ok: true, steps_per_mm: 400.0, ..SimulatorConfig::default() };
    let mut bench = bench(kind);
    (bench.config.axis, bench.config.reversed) = (crate::drivers::grbl::Axis::Y, true);
    stage_of(&bench);
}

#[test]
fn a_marlin_laser_passes_the_suite() {
    let bench = default_bench();
    let event_log = bench.simulator.event_log().clone();
    let profile = LaserProfile {
        light: Some(Box::new(move || event_log.light())),
        // `promises.md` 3: off within 0.5 s.
        reaction_limit: Duration::from_millis(500),
        cable: Some(cable(&bench)),
    };
    contract::laser(&mut || Box::new(bench.open().1), &profile);
}
