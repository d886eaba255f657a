//! The contract suite of stages.

use std::sync::Arc;
use std::time::Duration;

use super::{Bench, bench, default_bench};
use crate::contract::{self, Cable, StageProfile};
use crate::simulators::zaber_simulator::SimulatorConfig;

fn profile(bench: &Bench) -> StageProfile {
    let (unplugged, replugged) = (Arc::clone(&bench.simulator), Arc::clone(&bench.simulator));
    StageProfile {
        speed_mm_s: 20.0,
        // Settling error tolerated by the driver.
        tolerance_mm: 0.001,
        instant: false,
        motion_limit: Duration::from_secs(2),
        rest_limit: Duration::from_millis(300),
        reset_button: None,
        cable: Some(Cable {
            unplug: Box::new(move || unplugged.unplug()),
            replug: Box::new(move || replugged.replug()),
        }),
    }
}

#[test]
fn a_zaber_stage_passes_the_suite() {
    let bench = default_bench();
    contract::stage(&mut || Box::new(bench.open()), &profile(&bench));
}

#[test]
fn the_first_axis_of_two_on_the_third_device_passes_the_suite() {
    let bench = bench(SimulatorConfig { address: 3, n_axes: 2, checksums: true, ..SimulatorConfig::default() });
    contract::stage(&mut || Box::new(bench.open()), &profile(&bench));
}

#[test]
fn a_stage_against_the_device_s_direction_passes_the_suite() {
    let mut bench = default_bench();
    bench.config.reversed = true;
    contract::stage(&mut || Box::new(bench.open()), &profile(&bench));
}
