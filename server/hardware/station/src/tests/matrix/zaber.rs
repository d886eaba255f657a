//! A Zaber stage, simulated by the firmware model, beside the simulated laser and camera.

use std::sync::Arc;

use devices::Driver;
use devices::simulator::Simulator;
use devices::zaber::{ZaberDriver, ZaberSettings};
use devices::zaber_simulator::{Event, SimulatorConfig, ZaberFirmware};

use super::cell::Reaction::{self, Reported};
use super::cell::{Scenario, cells};
use super::controllers::InjectedFault::{self, Garbage, OtherDevice, Restart, Silence, Specific, Unplugged};
use super::controllers::{Controller, cell};

struct Zaber;

impl Controller for Zaber {
    type Firmware = ZaberFirmware;
    const SWITCHES_LASER: bool = false;

    fn machine(scenario: Scenario) -> SimulatorConfig {
        let usual = SimulatorConfig::default();
        match scenario {
            Scenario::Homing => SimulatorConfig { homing_mm_s: 25.0, start_at_mm: 60.0, ..usual },
            _ => usual,
        }
    }

    fn other(machine: SimulatorConfig) -> SimulatorConfig {
        SimulatorConfig { serial: 666, ..machine }
    }

    fn driver(port: String) -> Arc<dyn Driver> {
        let serial = SimulatorConfig::default().serial;
        Arc::new(ZaberDriver(ZaberSettings { port, serial, ..ZaberSettings::default() }))
    }

    fn repair(simulator: &Simulator<ZaberFirmware>) {
        simulator.trigger_event(Event::Repair);
    }

    fn comes_to_rest(fault: InjectedFault<Event>) -> bool {
        !matches!(fault, Specific(Event::StuckUndetected))
    }
}

const NO_RESPONSE: Reaction = Reported("stage", "no_response");
const UNREADABLE: Reaction = Reported("stage", "unreadable");
const ALARM: Reaction = Reported("stage", "alarm");
const DISCONNECTED: Reaction = Reported("stage", "disconnected");
const RESTARTED: Reaction = Reported("stage", "restarted");
const STALLED: Reaction = Reported("stage", "stalled");
const WRONG_DEVICE: Reaction = Reported("stage", "wrong_device");

cells! { zaber;
    silence: Silence =>
        absent: NO_RESPONSE, ready: NO_RESPONSE, live: NO_RESPONSE, scanning: NO_RESPONSE, calibrating: NO_RESPONSE,
        jogging: NO_RESPONSE, homing: NO_RESPONSE;
    garbage: Garbage =>
        absent: WRONG_DEVICE, ready: UNREADABLE, live: UNREADABLE, scanning: UNREADABLE, calibrating: UNREADABLE,
        jogging: UNREADABLE, homing: UNREADABLE;
    stall: Specific(Event::StuckUndetected) =>
        scanning: STALLED, calibrating: STALLED, jogging: STALLED;
    emergency_stop: Specific(Event::EmergencyStop) =>
        absent: ALARM, ready: ALARM, live: ALARM, scanning: ALARM, calibrating: ALARM, jogging: ALARM, homing: ALARM;
    unplugged: Unplugged =>
        absent: DISCONNECTED, ready: DISCONNECTED, live: DISCONNECTED, scanning: DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
    restart: Restart =>
        ready: RESTARTED, live: RESTARTED, scanning: RESTARTED, calibrating: RESTARTED, jogging: RESTARTED,
        homing: RESTARTED;
    other_device: OtherDevice =>
        absent: WRONG_DEVICE, ready: DISCONNECTED, live: DISCONNECTED, scanning: DISCONNECTED, calibrating: DISCONNECTED, jogging: DISCONNECTED, homing: DISCONNECTED;
}

fn zaber(scenario: Scenario, fault: InjectedFault<Event>, reaction: Reaction) {
    cell::<Zaber>(scenario, fault, reaction);
}
