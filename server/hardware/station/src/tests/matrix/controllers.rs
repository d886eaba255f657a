//! Shared by the tables of serial controllers: simulated firmware behind a pseudo-terminal, and its faults.

use std::fmt::Debug;
use std::sync::Arc;
use std::time::Duration;

use devices::Driver;
use devices::simulator::{Firmware, LineFault, Simulator};
use tempfile::TempDir;

use super::cell::{NAMED, Reaction, Rig, Scenario, check};
use crate::tests::bench::{Bench, bench_of, never_cancelled, small_devices};
use crate::{Manual, StationDevices};

/// A kind of controller.
pub trait Controller {
    /// Its simulated firmware.
    type Firmware: Firmware<Config: Clone, Event: Copy + Debug>;
    /// Whether it also switches the laser.
    const MAKES_LIGHT: bool;
    /// Time within which a fault during homing is reported.
    const NAMED_WHILE_HOMING: Duration = NAMED;

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
        panic!("it has none");
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
        let driver = C::driver(controller.place().display().to_string());
        let devices = StationDevices { stage: driver.clone(), ..small_devices() };
        let devices = if C::MAKES_LIGHT { StationDevices { laser: driver, ..devices } } else { devices };
        Self { bench: bench_of(devices), controller, machine, _folder: folder }
    }

    fn home(&self) {
        self.bench.manual(Manual::Home).unwrap();
        self.bench.wait_for("ready", |status| status.activity == "ready");
    }
}

type Event<C> = <<C as Controller>::Firmware as Firmware>::Event;

fn come<C: Controller>(simulator: &Simulator<C::Firmware>, machine: &Config<C>, trouble: InjectedFault<Event<C>>) {
    match trouble {
        InjectedFault::Silence => simulator.fail(LineFault::Silence),
        InjectedFault::Garbage => simulator.fail(LineFault::Garbage),
        InjectedFault::Unplugged => simulator.unplug(),
        InjectedFault::Restart => simulator.restart(),
        InjectedFault::OtherDevice => simulator.replug_as(C::other(machine.clone())),
        InjectedFault::Specific(event) => simulator.trigger_event(event),
    }
}

fn go<C: Controller>(simulator: &Simulator<C::Firmware>, machine: &Config<C>, trouble: InjectedFault<Event<C>>) {
    match trouble {
        InjectedFault::Unplugged => simulator.replug(),
        InjectedFault::OtherDevice => simulator.replug_as(machine.clone()),
        _ => simulator.repair(),
    }
    C::repair(simulator);
}

/// A cell of the controller's table.
pub fn cell<C: Controller>(scenario: Scenario, trouble: InjectedFault<Event<C>>, reaction: Reaction) {
    let machine = C::machine(scenario);
    let played = match scenario {
        Scenario::Absent => {
            ControllerBench::<C>::start(machine.clone(), |simulator| come::<C>(simulator, &machine, trouble))
        }
        Scenario::Homing => ControllerBench::<C>::start(machine, |_| {}),
        _ => ControllerBench::<C>::ready(machine),
    };
    let ControllerBench { bench, controller, machine, .. } = &played;
    let control = bench.control.clone();
    let witness = controller.witness();
    check(
        &Rig {
            bench,
            inject: &|| come::<C>(controller, machine, trouble),
            cure: &|| go::<C>(controller, machine, trouble),
            press_button: &|| C::press_button(controller),
            light: &|| if C::MAKES_LIGHT { witness.light() } else { control.laser_power() > 0.0 },
            motion: &|| witness.moving(),
            can_be_told: C::comes_to_rest(trouble),
            named_within: if scenario == Scenario::Homing { C::NAMED_WHILE_HOMING } else { NAMED },
        },
        scenario,
        reaction,
    );
}
