//! A Marlin controller of stage and laser, simulated by the firmware model.

use std::sync::Arc;
use std::time::Duration;

use devices::Driver;
use devices::marlin::{MarlinDriver, MarlinSettings};
use devices::marlin_simulator::{Event, MarlinFirmware, SimulatorConfig};
use devices::simulator::Simulator;

use super::cell::Follows::{self, Named};
use super::cell::{Doing, cells};
use super::controllers::Trouble::{self, Garbage, Happens, OtherDevice, Silence, Unplugged};
use super::controllers::{Controller, cell};

struct Marlin;

impl Controller for Marlin {
    type Firmware = MarlinFirmware;
    const MAKES_LIGHT: bool = true;
    /// The firmware reports once a second while homing.
    const NAMED_WHILE_HOMING: Duration = Duration::from_millis(1700);

    fn machine(doing: Doing) -> SimulatorConfig {
        let usual = SimulatorConfig { laser_timeout_ms: 0, ..SimulatorConfig::default() };
        match doing {
            Doing::Homing => SimulatorConfig { homing_mm_s: 20.0, start_at_mm: 60.0, ..usual },
            _ => usual,
        }
    }

    fn other(machine: SimulatorConfig) -> SimulatorConfig {
        SimulatorConfig { name: "another".to_owned(), ..machine }
    }

    fn driver(port: String) -> Arc<dyn Driver> {
        let SimulatorConfig { steps_per_mm, name, .. } = SimulatorConfig::default();
        Arc::new(MarlinDriver(MarlinSettings { port, steps_per_mm, identity: name, ..MarlinSettings::default() }))
    }

    fn repair(simulator: &Simulator<MarlinFirmware>) {
        simulator.happen(Event::Repair);
    }

    /// A machine that was on or homing was halted by `M112`.
    fn press_button(simulator: &Simulator<MarlinFirmware>) {
        simulator.happen(Event::ResetButton);
    }
}

const NO_REPLY: Follows = Named("stage", "no_reply");
const ENDSTOP: Follows = Named("stage", "alarm");
const GONE: Follows = Named("stage", "gone");
const RESTARTED: Follows = Named("stage", "restarted");
const STALLED: Follows = Named("stage", "stalled");
const WRONG_DEVICE: Follows = Named("stage", "wrong_device");

cells! { marlin;
    silence: Silence =>
        absent: NO_REPLY, ready: NO_REPLY, live: NO_REPLY, scanning: NO_REPLY, calibrating: NO_REPLY,
        jogging: NO_REPLY, homing: NO_REPLY;
    garbage: Garbage =>
        absent: WRONG_DEVICE, ready: NO_REPLY, live: NO_REPLY, scanning: NO_REPLY, calibrating: NO_REPLY,
        jogging: NO_REPLY, homing: NO_REPLY;
    endstop: Happens(Event::EndstopHit) =>
        scanning: ENDSTOP, calibrating: ENDSTOP, jogging: ENDSTOP;
    kill: Happens(Event::Kill) =>
        absent: GONE, ready: GONE, live: GONE, scanning: GONE, calibrating: GONE, jogging: GONE, homing: GONE;
    unplugged: Unplugged =>
        absent: GONE, ready: GONE, live: GONE, scanning: GONE, calibrating: GONE, jogging: GONE, homing: GONE;
    restart: Happens(Event::ResetButton) =>
        ready: RESTARTED, live: RESTARTED, scanning: RESTARTED, calibrating: RESTARTED, jogging: RESTARTED,
        homing: RESTARTED;
    stall: Happens(Event::Stuck) =>
        scanning: STALLED, calibrating: STALLED, jogging: STALLED;
    other_device: OtherDevice =>
        absent: WRONG_DEVICE, ready: GONE, live: GONE, scanning: GONE, calibrating: GONE, jogging: GONE, homing: GONE;
}

fn marlin(doing: Doing, trouble: Trouble<Event>, follows: Follows) {
    cell::<Marlin>(doing, trouble, follows);
}
