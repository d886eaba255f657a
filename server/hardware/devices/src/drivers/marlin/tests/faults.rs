//! Fault × state: reported in time, laser off and at rest, and recovery to ready, never active. The table in
//! `server/docs/devices/marlin.md` names these tests cell by cell.

use std::time::Duration;

use super::{Bench, RUN_OUT, SLACK, bench, home, rest, wait_until};
use crate::drivers::marlin::{MarlinLaser, MarlinStage};
use crate::simulators::marlin_simulator::{Event, SimulatorConfig};
use crate::simulators::simulator::LineFault;
use crate::{Laser, Stage, StageError};

/// `promises.md`: serial faults are reported within a second.
const REPORT_LIMIT: Duration = Duration::from_secs(1);

/// While it is homing the firmware sends a message every second only (`M113 S1`).
const HOMING_REPORT_LIMIT: Duration = Duration::from_millis(1700);

/// `promises.md` 3: laser off within half a second of every listed fault (here: of its report).
const LASER_OFF_LIMIT: Duration = Duration::from_millis(500);

#[derive(Debug, Clone, Copy, PartialEq)]
enum When {
    Ready,
    Moving,
    Homing,
    Emitting,
    EmittingAndMoving,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum FaultKind {
    Silence,
    Garbage,
    Endstop,
    Kill,
    Stuck,
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
    silence_while_emitting: Silence, Emitting => StageError::NoResponse { .. },
    silence_while_emitting_and_moving: Silence, EmittingAndMoving => StageError::NoResponse { .. },
    garbage_when_ready: Garbage, Ready => StageError::Unreadable { .. },
    garbage_while_moving: Garbage, Moving => StageError::Unreadable { .. },
    garbage_while_homing: Garbage, Homing => StageError::Unreadable { .. },
    garbage_while_emitting: Garbage, Emitting => StageError::Unreadable { .. },
    garbage_while_emitting_and_moving: Garbage, EmittingAndMoving => StageError::Unreadable { .. },
    an_endstop_while_moving: Endstop, Moving => StageError::Warned { .. },
    an_endstop_while_emitting_and_moving: Endstop, EmittingAndMoving => StageError::Warned { .. },
    a_kill_when_ready: Kill, Ready => StageError::Disconnected { .. },
    a_kill_while_moving: Kill, Moving => StageError::Disconnected { .. },
    a_kill_while_homing: Kill, Homing => StageError::Disconnected { .. },
    a_kill_while_emitting: Kill, Emitting => StageError::Disconnected { .. },
    a_stall_while_moving: Stuck, Moving => StageError::Stalled { .. },
    a_stall_while_emitting_and_moving: Stuck, EmittingAndMoving => StageError::Stalled { .. },
    a_pulled_cable_when_ready: Unplugged, Ready => StageError::Disconnected { .. },
    a_pulled_cable_while_moving: Unplugged, Moving => StageError::Disconnected { .. },
    a_pulled_cable_while_homing: Unplugged, Homing => StageError::Disconnected { .. },
    a_pulled_cable_while_emitting: Unplugged, Emitting => StageError::Disconnected { .. },
    a_restart_when_ready: Restart, Ready => StageError::Restarted,
    a_restart_while_moving: Restart, Moving => StageError::Restarted,
    a_restart_while_homing: Restart, Homing => StageError::Restarted,
    a_restart_while_emitting: Restart, Emitting => StageError::Restarted,
    a_restart_while_emitting_and_moving: Restart, EmittingAndMoving => StageError::Restarted,
    another_device_when_ready: AnotherDevice, Ready => StageError::Disconnected { .. } | StageError::WrongDevice { .. },
    another_device_while_moving: AnotherDevice, Moving => StageError::Disconnected { .. } | StageError::WrongDevice { .. },
}

fn cell(what: FaultKind, when: When, expected: impl Fn(&StageError) -> bool) {
    let bench = bench(SimulatorConfig { laser_timeout_ms: 0, ..SimulatorConfig::default() });
    let (mut stage, mut laser) = bench.open();
    bring_to(&bench, &mut stage, &mut laser, when);
    trigger_event(&bench, what);
    let limit = if when == When::Homing { HOMING_REPORT_LIMIT } else { REPORT_LIMIT };
    wait_until(limit + SLACK, "the fault is reported", || {
        if matches!(when, When::Emitting | When::EmittingAndMoving) {
            laser.renew(Duration::from_secs(1)).ok();
        }
        stage.poll().is_err()
    });
    let fault = stage.poll().unwrap_err();
    assert!(expected(&fault), "reported as: {fault}");
    assert!(stage.poll().is_err(), "reported once only");
    assert!(stage.start_move(0.0, 10.0).is_err(), "a move was accepted despite the fault");
    assert!(laser.switch_on(0.5, Duration::from_secs(1)).is_err(), "the laser was switched on despite the fault");
    // A stuck axis prolongs the motion for which `M5` waits: the quick stop, or `M112`, ends it.
    let off_limit = if what == FaultKind::Stuck { Duration::from_secs(4) } else { LASER_OFF_LIMIT };
    wait_until(off_limit + SLACK, "it is off", || !bench.light());
    if what != FaultKind::Stuck {
        wait_until(RUN_OUT + SLACK, "it rests", || !bench.moving());
    }
    recovers_ready(&bench, &mut stage, &mut laser);
}

fn bring_to(bench: &Bench, stage: &mut MarlinStage, laser: &mut MarlinLaser, when: When) {
    home(stage);
    stage.start_move(4.0, 100.0).unwrap();
    rest(stage);
    if matches!(when, When::Emitting | When::EmittingAndMoving) {
        laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
        wait_until(SLACK, "it is on", || bench.light());
    }
    match when {
        // Slow enough to last longer than any fault takes to be reported.
        When::Moving | When::EmittingAndMoving => drop(stage.start_move(-4.0, 3.0).unwrap()),
        When::Homing => stage.start_home().unwrap(),
        When::Ready | When::Emitting => return,
    }
    wait_until(SLACK, "it moves", || bench.moving());
}

fn trigger_event(bench: &Bench, what: FaultKind) {
    let simulator = &bench.simulator;
    match what {
        FaultKind::Silence => simulator.fail(LineFault::Silence),
        FaultKind::Garbage => simulator.fail(LineFault::Garbage),
        FaultKind::Endstop => simulator.trigger_event(Event::EndstopHit),
        FaultKind::Kill => simulator.trigger_event(Event::Kill),
        FaultKind::Stuck => simulator.trigger_event(Event::Stuck),
        FaultKind::Unplugged => simulator.unplug(),
        FaultKind::Restart => simulator.trigger_event(Event::ResetButton),
        FaultKind::AnotherDevice => {
            simulator.replug_as(SimulatorConfig { name: "another".into(), ..SimulatorConfig::default() });
        }
    }
}

/// The cause is removed, the reset button pressed, the fault acknowledged: no motion, laser off, and no position
/// reported.
fn recovers_ready(bench: &Bench, stage: &mut MarlinStage, laser: &mut MarlinLaser) {
    bench.simulator.repair();
    bench.simulator.trigger_event(Event::Repair);
    bench.simulator.replug();
    let mark = bench.simulator.event_log().mark();
    stage.reconnect().unwrap();
    wait_until(Duration::from_secs(8), "it is reconnected", || {
        if stage.clear_fault().is_err() {
            stage.reconnect().unwrap();
        }
        stage.poll().is_ok()
    });
    wait_until(Duration::from_secs(4), "it rests", || stage.poll().is_ok_and(|state| !state.moving));
    let state = stage.poll().unwrap();
    assert!(!state.homed && state.position_mm.is_none(), "state after the reconnection: {state:?}");
    assert!(!laser.poll().unwrap().emitting && !bench.light(), "the laser is on after the reconnection");
    assert_eq!(bench.simulator.event_log().n_motions_since(mark), 0, "a motion was repeated");
    home(stage);
    stage.start_move(1.0, 50.0).unwrap();
    let at_mm = rest(stage).position_mm.unwrap();
    assert!((at_mm - 1.0).abs() < 0.03, "homed and moved to 1 mm, and it is at {at_mm} mm");
}
