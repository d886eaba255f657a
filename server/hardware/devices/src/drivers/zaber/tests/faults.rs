//! Fault × state: reported within a second, at rest, and recovery to ready, never active. The table in
//! `server/docs/devices/zaber.md` names these tests cell by cell.

use std::time::Duration;

use super::{Bench, SLACK, default_bench, home, rest, wait_until};
use crate::drivers::zaber::ZaberStage;
use crate::simulators::simulator::LineFault;
use crate::simulators::zaber_simulator::{Event, SimulatorConfig};
use crate::{Stage, StageError};

/// `promises.md`: serial faults are reported within a second.
const REPORT_LIMIT: Duration = Duration::from_secs(1);

#[derive(Debug, Clone, Copy, PartialEq)]
enum When {
    Ready,
    Moving,
    Homing,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum FaultKind {
    Silence,
    Garbage,
    Stall,
    StuckUndetected,
    EmergencyStop,
    Knob,
    Push,
    Unplugged,
    Restart,
    AnotherDevice,
}

macro_rules! cells {
    ($($name:ident: $what:ident, $when:ident => $expected:pat,)*) => {
        $(#[test]
        fn $name() {
            cell(FaultKind::$what, When::$when, |fault| matches!(fault, $expected));
        })*
    };
}

cells! {
    silence_when_ready: Silence, Ready => StageError::NoResponse { .. },
    silence_while_moving: Silence, Moving => StageError::NoResponse { .. },
    silence_while_homing: Silence, Homing => StageError::NoResponse { .. },
    garbage_when_ready: Garbage, Ready => StageError::Unreadable { .. },
    garbage_while_moving: Garbage, Moving => StageError::Unreadable { .. },
    garbage_while_homing: Garbage, Homing => StageError::Unreadable { .. },
    a_stall_while_moving: Stall, Moving => StageError::Stalled { .. },
    a_stall_while_homing: Stall, Homing => StageError::Warned { .. },
    an_undetected_stall_while_moving: StuckUndetected, Moving => StageError::Stalled { .. },
    an_emergency_stop_when_ready: EmergencyStop, Ready => StageError::Warned { .. },
    an_emergency_stop_while_moving: EmergencyStop, Moving => StageError::Warned { .. },
    an_emergency_stop_while_homing: EmergencyStop, Homing => StageError::Warned { .. },
    a_knob_while_moving: Knob, Moving => StageError::Stalled { .. },
    a_push_when_ready: Push, Ready => StageError::Warned { .. },
    a_pulled_cable_when_ready: Unplugged, Ready => StageError::Disconnected { .. },
    a_pulled_cable_while_moving: Unplugged, Moving => StageError::Disconnected { .. },
    a_pulled_cable_while_homing: Unplugged, Homing => StageError::Disconnected { .. },
    a_restart_when_ready: Restart, Ready => StageError::Restarted,
    a_restart_while_moving: Restart, Moving => StageError::Restarted,
    a_restart_while_homing: Restart, Homing => StageError::Restarted,
    another_device_when_ready: AnotherDevice, Ready => StageError::Disconnected { .. } | StageError::WrongDevice { .. },
    another_device_while_moving: AnotherDevice, Moving => StageError::Disconnected { .. } | StageError::WrongDevice { .. },
}

fn cell(what: FaultKind, when: When, expected: impl Fn(&StageError) -> bool) {
    let bench = default_bench();
    let mut stage = bench.open();
    bring_to(&bench, &mut stage, when);
    trigger_event(&bench, what);
    wait_until(REPORT_LIMIT + SLACK, "the fault is reported", || stage.poll().is_err());
    let fault = stage.poll().unwrap_err();
    assert!(expected(&fault), "reported as: {fault}");
    assert!(stage.poll().is_err(), "reported once only");
    assert!(stage.start_move(0.0, 10.0).is_err(), "a move was accepted despite the fault");
    if what != FaultKind::StuckUndetected {
        wait_until(SLACK, "it rests", || !bench.moving());
    }
    recovers_ready(&bench, &mut stage, what);
}

fn bring_to(bench: &Bench, stage: &mut ZaberStage, when: When) {
    home(stage);
    stage.start_move(4.0, 100.0).unwrap();
    rest(stage);
    match when {
        When::Ready => return,
        // Slow enough to last longer than any fault takes to be reported.
        When::Moving => drop(stage.start_move(-4.0, 4.0).unwrap()),
        When::Homing => stage.start_home().unwrap(),
    }
    wait_until(SLACK, "it moves", || bench.moving());
}

fn trigger_event(bench: &Bench, what: FaultKind) {
    let simulator = &bench.simulator;
    match what {
        FaultKind::Silence => simulator.fail(LineFault::Silence),
        FaultKind::Garbage => simulator.fail(LineFault::Garbage),
        FaultKind::Stall => simulator.trigger_event(Event::Stall),
        FaultKind::StuckUndetected => simulator.trigger_event(Event::StuckUndetected),
        FaultKind::EmergencyStop => simulator.trigger_event(Event::EmergencyStop),
        FaultKind::Knob => simulator.trigger_event(Event::Knob),
        FaultKind::Push => simulator.trigger_event(Event::Push),
        FaultKind::Unplugged => simulator.unplug(),
        FaultKind::Restart => simulator.restart(),
        FaultKind::AnotherDevice => {
            simulator.replug_as(SimulatorConfig { serial: 666, ..SimulatorConfig::default() });
        }
    }
}

/// The cause is removed and the fault acknowledged: no motion, and no position reported.
fn recovers_ready(bench: &Bench, stage: &mut ZaberStage, what: FaultKind) {
    bench.simulator.repair();
    bench.simulator.trigger_event(Event::Repair);
    if what == FaultKind::Unplugged {
        bench.simulator.replug();
    }
    wait_until(SLACK, "it rests", || !bench.moving());
    let mark = bench.simulator.event_log().mark();
    if stage.clear_fault().is_err() {
        stage.reconnect().unwrap();
    }
    wait_until(Duration::from_secs(5), "it is reconnected and at rest", || {
        stage.poll().is_ok_and(|state| !state.moving)
    });
    let state = stage.poll().unwrap();
    assert!(
        !state.moving && !state.homed && state.position_mm.is_none(),
        "state after the reconnection: {state:?}"
    );
    assert_eq!(bench.simulator.event_log().n_motions_since(mark), 0, "a motion was repeated");
    home(stage);
    stage.start_move(1.0, 50.0).unwrap();
    let at_mm = rest(stage).position_mm.unwrap();
    assert!((at_mm - 1.0).abs() < 0.01, "homed and moved to 1 mm, and it is at {at_mm} mm");
}

#[test]
fn a_device_exchanged_on_a_live_line_is_detected_by_its_serial_number() {
    let mut bench = default_bench();
    bench.config.expected_serial = Some(80_001);
    let mut stage = bench.open();
    home(&mut stage);
    bench.simulator.replug_as(SimulatorConfig { serial: 666, ..SimulatorConfig::default() });
    wait_until(REPORT_LIMIT + SLACK, "it is noticed", || stage.poll().is_err());
    stage.reconnect().unwrap();
    wait_until(Duration::from_secs(2), "it is reported", || {
        matches!(stage.poll(), Err(StageError::WrongDevice { .. }))
    });
}

#[test]
fn an_emergency_stop_that_stays_pressed_stays_a_fault() {
    let bench = default_bench();
    let mut stage = bench.open();
    home(&mut stage);
    bench.simulator.trigger_event(Event::EmergencyStop);
    wait_until(REPORT_LIMIT + SLACK, "it is reported", || stage.poll().is_err());
    stage.clear_fault().unwrap();
    for _ in 0..200 {
        assert!(matches!(stage.poll(), Err(StageError::Warned { .. })), "cleared while it is pressed");
        crate::time::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_flag_that_is_set_when_the_device_is_opened_is_a_fault_at_once_and_can_be_cleared() {
    for what in [FaultKind::EmergencyStop, FaultKind::Stall, FaultKind::Push] {
        let bench = default_bench();
        trigger_event(&bench, what);
        let mut stage = bench.open();
        let fault = stage.poll();
        assert!(matches!(fault, Err(StageError::Warned { .. })), "{what:?}: {fault:?}");
        recovers_ready(&bench, &mut stage, what);
    }
}

#[test]
fn a_device_reopened_with_its_emergency_stop_pressed_is_never_without_fault() {
    let bench = default_bench();
    let mut stage = bench.open();
    bench.simulator.unplug();
    wait_until(REPORT_LIMIT + SLACK, "it is noticed", || stage.poll().is_err());
    bench.simulator.trigger_event(Event::EmergencyStop);
    bench.simulator.replug();
    stage.reconnect().unwrap();
    wait_until(Duration::from_secs(5), "it is opened", || {
        let fault = stage.poll().expect_err("it works despite its emergency stop");
        matches!(fault, StageError::Warned { .. })
    });
}
