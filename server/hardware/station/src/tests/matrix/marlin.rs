//! A Marlin controller of stage and laser, simulated by the firmware model.

use std::sync::Arc;
use std::time::Duration;

use devices::Driver;
use devices::marlin::{MarlinDriver, MarlinSettings};
use devices::marlin_simulator::{Event, MarlinFirmware, SimulatorConfig};
use devices::simulator::Simulator;

use super::cell::Reaction::{self, Reported, ReportedEither};
use super::cell::{Scenario, cells};
use super::controllers::InjectedFault::{self, Garbage, OtherDevice, Silence, Specific, Unplugged};
use super::controllers::{Controller, cell};

struct Marlin;

impl Controller for Marlin {
    type Firmware = MarlinFirmware;
    const SWITCHES_LASER: bool = true;
    /// The firmware reports once a second while homing.
    const HOMING_REPORT_LIMIT: Duration = Duration::from_millis(1700);

    fn machine(scenario: Scenario) -> SimulatorConfig {
        let usual = SimulatorConfig { laser_timeout_ms: 0, ..SimulatorConfig::default() };
        match scenario {
            Scenario::Homing => SimulatorConfig { homing_mm_s: 20.0, start_at_mm: 60.0, ..usual },
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
        simulator.trigger_event(Event::Repair);
    }

    /// A machine that was on or homing was halted by `M112`.
    fn press_button(simulator: &Simulator<MarlinFirmware>) {
        simulator.trigger_event(Event::ResetButton);
    }
}

const NO_RESPONSE: Reaction = Reported("stage", "no_response");
/// A calibration keeps switching the laser off: without an answer to `M5` in 250 ms the driver halts the controller, which
/// can be before the silence of another line is reported.
const NO_RESPONSE_OR_HALTED: Reaction = ReportedEither("stage", ["no_response", "disconnected"]);
const UNREADABLE: Reaction = Reported("stage", "unreadable");
/// As [`NO_RESPONSE_OR_HALTED`].
const UNREADABLE_OR_HALTED: Reaction = ReportedEither("stage", ["unreadable", "disconnected"]);
const ENDSTOP: Reaction = Reported("stage", "alarm");
const DISCONNECTED: Reaction = Reported("stage", "disconnected");
const RESTARTED: Reaction = Reported("stage", "restarted");
const STALLED: Reaction = Reported("stage", "stalled");
const WRONG_DEVICE: Reaction = Reported("stage", "wrong_device");

cells! { marlin;
    silence: Silence =>
        absent: NO_RESPONSE, ready: NO_RESPONSE, live: NO_RESPONSE, scanning: NO_RESPONSE,
        calibrating: NO_RESPONSE_OR_HALTED,
        jogging: NO_RESPONSE, homing: NO_RESPONSE;
    garbage: Garbage =>
        absent: WRONG_DEVICE, ready: UNREADABLE, live: UNREADABLE, scanning: UNREADABLE,
        calibrating: UNREADABLE_OR_HALTED,
        jogging: UNREADABLE, homing: UNREADABLE;
    endstop: Specific(Event::EndstopHit) =>
        scanning: ENDSTOP, calibrating: ENDSTOP, jogging: ENDSTOP;
    kill: Specific(Event::Kill) =>
        absent: DISCONNECTED, ready: DISCONNECTED, live: DISCONNECTED, scanning: DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
    unplugged: Unplugged =>
        absent: DISCONNECTED, ready: DISCONNECTED, live: DISCONNECTED, scanning: DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
    restart: Specific(Event::ResetButton) =>
        ready: RESTARTED, live: RESTARTED, scanning: RESTARTED, calibrating: RESTARTED, jogging: RESTARTED,
        homing: RESTARTED;
    stall: Specific(Event::Stuck) =>
        scanning: STALLED, calibrating: STALLED, jogging: STALLED;
    other_device: OtherDevice =>
        absent: WRONG_DEVICE, ready: DISCONNECTED, live: DISCONNECTED, scanning: DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
}

fn marlin(scenario: Scenario, fault: InjectedFault<Event>, reaction: Reaction) {
    cell::<Marlin>(scenario, fault, reaction);
}
