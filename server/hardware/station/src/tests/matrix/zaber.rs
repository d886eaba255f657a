//! A Zaber stage, played by the simulated device, beside the simulated laser and camera.

use std::sync::Arc;

use devices::Driver;
use devices::simulator::Simulator;
use devices::zaber::{ZaberDriver, ZaberSettings};
use devices::zaber_simulator::{Event, SimulatorConfig, ZaberFirmware};

use super::cell::Follows::{self, Named};
use super::cell::{Doing, cells};
use super::controllers::Trouble::{self, Garbage, Happens, OtherDevice, Restart, Silence, Unplugged};
use super::controllers::{Controller, cell};

struct Zaber;

impl Controller for Zaber {
    type Firmware = ZaberFirmware;
    const MAKES_LIGHT: bool = false;

    fn machine(doing: Doing) -> SimulatorConfig {
        let usual = SimulatorConfig::default();
        match doing {
            Doing::Homing => SimulatorConfig { homing_mm_s: 25.0, start_at_mm: 60.0, ..usual },
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
        simulator.happen(Event::Repair);
    }

    fn comes_to_rest(trouble: Trouble<Event>) -> bool {
        !matches!(trouble, Happens(Event::StuckUnnoticed))
    }
}

const NO_REPLY: Follows = Named("stage", "no_reply");
const GARBAGE: Follows = Named("stage", "garbage");
const ALARM: Follows = Named("stage", "alarm");
const GONE: Follows = Named("stage", "gone");
const RESTARTED: Follows = Named("stage", "restarted");
const STALLED: Follows = Named("stage", "stalled");
const WRONG_DEVICE: Follows = Named("stage", "wrong_device");

cells! { zaber;
    silence: Silence =>
        absent: NO_REPLY, ready: NO_REPLY, live: NO_REPLY, scanning: NO_REPLY, calibrating: NO_REPLY,
        jogging: NO_REPLY, homing: NO_REPLY;
    garbage: Garbage =>
        absent: WRONG_DEVICE, ready: GARBAGE, live: GARBAGE, scanning: GARBAGE, calibrating: GARBAGE,
        jogging: GARBAGE, homing: GARBAGE;
    stall: Happens(Event::StuckUnnoticed) =>
        scanning: STALLED, calibrating: STALLED, jogging: STALLED;
    emergency_stop: Happens(Event::EmergencyStop) =>
        absent: ALARM, ready: ALARM, live: ALARM, scanning: ALARM, calibrating: ALARM, jogging: ALARM, homing: ALARM;
    unplugged: Unplugged =>
        absent: GONE, ready: GONE, live: GONE, scanning: GONE, calibrating: GONE, jogging: GONE, homing: GONE;
    restart: Restart =>
        ready: RESTARTED, live: RESTARTED, scanning: RESTARTED, calibrating: RESTARTED, jogging: RESTARTED,
        homing: RESTARTED;
    other_device: OtherDevice =>
        absent: WRONG_DEVICE, ready: GONE, live: GONE, scanning: GONE, calibrating: GONE, jogging: GONE, homing: GONE;
}

fn zaber(doing: Doing, trouble: Trouble<Event>, follows: Follows) {
    cell::<Zaber>(doing, trouble, follows);
}
