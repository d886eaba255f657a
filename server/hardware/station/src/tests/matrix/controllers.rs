//! Shared by the tables of serial controllers: simulated firmware behind a pseudo-terminal, and its faults.

use std::fmt::Debug;
use std::sync::Arc;
use std::time::Duration;

use devices::Driver;
use devices::simulator::{Firmware, LineFault, Simulator};
use tempfile::TempDir;

use super::cell::{REPORT_LIMIT, Reaction, Rig, Scenario, check};
use crate::tests::bench::{Bench, bench_of, never_cancelled, small_devices};
use crate::{Manual, StationDevices};

/// A kind of controller.
pub trait Controller {
    /// Its simulated firmware.
    type Firmware: Firmware<Config: Clone, Event: Copy + Debug>;
    /// Whether it also switches the laser.
    const SWITCHES_LASER: bool;
    /// Time within which a fault during homing is reported.
    const HOMING_REPORT_LIMIT: Duration = REPORT_LIMIT;

    /// The machine of such a cell; homing must last longer than the report of a fault takes.
    fn machine(scenario: Scenario) -> Config<Self>;
    /// Another machine of the same kind.
    fn other(machine: Config<Self>) -> Config<Self>;
    /// The driver of the controller at this port.
    fn driver(port: String) -> Arc<dyn Driver>;
    /// Manual repair of the machine that is necessary beside ending a fault.
    fn repair(_simulator: &Simulator<Self::Firmware>) {}
    /// Presses its reset button.
    fn press_button(_simulator: &Simulator<Self::Firmware>) {
        panic!("this controller has no reset button");
    }
    /// Whether the simulation comes to rest after such a fault: a motor that is stuck undetected keeps trying.
    fn comes_to_rest(_trouble: InjectedFault<<Self::Firmware as Firmware>::Event>) -> bool {
        true
    }
}

type Config<C> = <<C as Controller>::Firmware as Firmware>::Config;

/// A fault of the controller or of its line.
#[derive(Debug, Clone, Copy)]
pub enum InjectedFault<E> {
    /// It receives and executes everything, and sends nothing.
    Silence,
    /// It sends invalid data.
    Garbage,
    /// Its cable is unplugged, which also supplies its power.
    Unplugged,
    /// It is switched off and on.
    Restart,
    /// It is replaced by another one.
    OtherDevice,
    /// A fault specific to its kind.
    Specific(E),
}

/// A station with a simulated controller.
pub struct ControllerBench<C: Controller> {
    /// The station.
    pub bench: Bench,
    /// The controller.
    pub controller: Simulator<C::Firmware>,
    machine: Config<C>,
    _folder: TempDir,
}

impl<C: Controller> ControllerBench<C> {
    /// A station with this machine, homed and at zero.
    pub fn ready(machine: Config<C>) -> Self {
        let played = Self::start(machine, |_| {});
        played.home();
        played.bench.lease().move_to(0.0, None, &never_cancelled()).unwrap();
        played
    }

    /// A station with a machine to which `before` is applied before it is opened.
    fn start(machine: Config<C>, before: impl FnOnce(&Simulator<C::Firmware>)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let controller = Simulator::start(machine.clone(), &folder.path().join("tty"), None).unwrap();
        before(&controller);
        let driver = C::driver(controller.port_name().display().to_string());
        let devices = StationDevices { stage: driver.clone(), ..small_devices() };
        let devices = if C::SWITCHES_LASER { StationDevices { laser: driver, ..devices } } else { devices };
        Self { bench: bench_of(devices), controller, machine, _folder: folder }
    }

    fn home(&self) {
        self.bench.wait_for("opened", |status| ["not homed", "ready"].contains(&status.activity.as_str()));
        self.bench.manual(Manual::Home).unwrap();
        self.bench.wait_for("ready", |status| status.activity == "ready");
    }
}

type Event<C> = <<C as Controller>::Firmware as Firmware>::Event;

fn inject<C: Controller>(simulator: &Simulator<C::Firmware>, machine: &Config<C>, fault: InjectedFault<Event<C>>) {
    match fault {
        InjectedFault::Silence => simulator.fail(LineFault::Silence),
        InjectedFault::Garbage => simulator.fail(LineFault::Garbage),
        InjectedFault::Unplugged => simulator.unplug(),
        InjectedFault::Restart => simulator.restart(),
        InjectedFault::OtherDevice => simulator.replug_as(C::other(machine.clone())),
        InjectedFault::Specific(event) => simulator.trigger_event(event),
    }
}

fn clear<C: Controller>(simulator: &Simulator<C::Firmware>, machine: &Config<C>, fault: InjectedFault<Event<C>>) {
    match fault {
        InjectedFault::Unplugged => simulator.replug(),
        InjectedFault::OtherDevice => simulator.replug_as(machine.clone()),
        _ => simulator.repair(),
    }
    C::repair(simulator);
}

/// A cell of the controller's table.
pub fn cell<C: Controller>(scenario: Scenario, fault: InjectedFault<Event<C>>, reaction: Reaction) {
    let machine = C::machine(scenario);
    let played = match scenario {
        Scenario::Absent => {
            ControllerBench::<C>::start(machine.clone(), |simulator| inject::<C>(simulator, &machine, fault))
        }
        Scenario::Homing => ControllerBench::<C>::start(machine, |_| {}),
        _ => ControllerBench::<C>::ready(machine),
    };
    let ControllerBench { bench, controller, machine, .. } = &played;
    let control = bench.control.clone();
    let event_log = controller.event_log();
    check(
        &Rig {
            bench,
            inject: &|| inject::<C>(controller, machine, fault),
            clear: &|| clear::<C>(controller, machine, fault),
            press_button: &|| C::press_button(controller),
            light: &|| if C::SWITCHES_LASER { event_log.light() } else { control.laser_power() > 0.0 },
            motion: &|| event_log.moving(),
            stop_reaches_stage: C::comes_to_rest(fault),
            report_limit: if scenario == Scenario::Homing { C::HOMING_REPORT_LIMIT } else { REPORT_LIMIT },
        },
        scenario,
        reaction,
    );
}
