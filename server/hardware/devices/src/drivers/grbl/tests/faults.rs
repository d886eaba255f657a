//! Fault × state: reported within a second, laser off and at rest, and recovery to ready, never active. The table in
//! `server/docs/devices/grbl.md` names these tests cell by cell.

use std::time::Duration;

use super::{Bench, SLACK, bench, home, rest, wait_until};
use crate::drivers::grbl::{GrblLaser, GrblStage};
use crate::simulators::grbl_simulator::{Dialect, Event, SimulatorConfig};
use crate::simulators::simulator::LineFault;
use crate::{Laser, Stage, StageError};

/// `promises.md`: serial faults are reported within a second.
const REPORT_LIMIT: Duration = Duration::from_secs(1);
/// `promises.md` 3: laser off within half a second of every listed fault (here: of its report).
const LASER_OFF_LIMIT: Duration = Duration::from_millis(500);

/// FluidNC leaves the laser on after a limit alarm and accepts the reset after the pause; the reset raises `ALARM:14`,
/// whose pause comes before the spindle is stopped (`protocol_do_rt_reset`). With `off_on_alarm` it is off at once.
const FLUID_NC_PAUSES: Duration = Duration::from_millis(2 * 500);

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
    HardLimit,
    Unplugged,
    Restart,
    Stall,
    AnotherDevice,
}

/// One test for each cell, for each of the given dialects.
macro_rules! cells {
    ($($dialect:ident: $module:ident),* => $cells:tt) => {
        $(mod $module {
            use super::*;
            one_dialect!($dialect => $cells);
        })*
    };
}

macro_rules! one_dialect {
    ($dialect:ident => {$($name:ident: $what:ident, $when:ident => $expected:pat,)*}) => {
        $(#[test]
        fn $name() {
            cell(Dialect::$dialect, FaultKind::$what, When::$when, |fault| matches!(fault, $expected));
        })*
    };
}

cells! { Grbl: grbl, GrblHal: grbl_hal, FluidNc: fluid_nc => {
    silence_when_ready: Silence, Ready => StageError::NoResponse { .. },
    silence_while_moving: Silence, Moving => StageError::NoResponse { .. },
    silence_while_emitting: Silence, Emitting => StageError::NoResponse { .. },
    silence_while_emitting_and_moving: Silence, EmittingAndMoving => StageError::NoResponse { .. },
    garbage_when_ready: Garbage, Ready => StageError::Unreadable { .. },
    garbage_while_moving: Garbage, Moving => StageError::Unreadable { .. },
    garbage_while_emitting: Garbage, Emitting => StageError::Unreadable { .. },
    garbage_while_emitting_and_moving: Garbage, EmittingAndMoving => StageError::Unreadable { .. },
    an_alarm_when_ready: HardLimit, Ready => StageError::Alarm { code: 1, .. },
    an_alarm_while_moving: HardLimit, Moving => StageError::Alarm { code: 1, .. },
    an_alarm_while_homing: HardLimit, Homing => StageError::Alarm { code: 1, .. },
    an_alarm_while_emitting: HardLimit, Emitting => StageError::Alarm { code: 1, .. },
    an_alarm_while_emitting_and_moving: HardLimit, EmittingAndMoving => StageError::Alarm { code: 1, .. },
    a_pulled_cable_when_ready: Unplugged, Ready => StageError::Disconnected { .. },
    a_pulled_cable_while_moving: Unplugged, Moving => StageError::Disconnected { .. },
    a_pulled_cable_while_homing: Unplugged, Homing => StageError::Disconnected { .. },
    a_pulled_cable_while_emitting: Unplugged, Emitting => StageError::Disconnected { .. },
    a_pulled_cable_while_emitting_and_moving: Unplugged, EmittingAndMoving => StageError::Disconnected { .. },
    a_restart_when_ready: Restart, Ready => StageError::Restarted,
    a_restart_while_moving: Restart, Moving => StageError::Restarted,
    a_restart_while_homing: Restart, Homing => StageError::Restarted,
    a_restart_while_emitting: Restart, Emitting => StageError::Restarted,
    a_restart_while_emitting_and_moving: Restart, EmittingAndMoving => StageError::Restarted,
    a_stall_while_moving: Stall, Moving => StageError::Stalled { .. },
    a_stall_while_emitting_and_moving: Stall, EmittingAndMoving => StageError::Stalled { .. },
    another_device_when_ready: AnotherDevice, Ready => StageError::Disconnected { .. } | StageError::WrongDevice { .. },
    another_device_while_moving: AnotherDevice, Moving => StageError::Disconnected { .. } | StageError::WrongDevice { .. },
}}

// GRBL 1.1 answers nothing while homing; the silence of the others is detected.
cells! { GrblHal: grbl_hal_homing, FluidNc: fluid_nc_homing => {
    silence_while_homing: Silence, Homing => StageError::NoResponse { .. },
    garbage_while_homing: Garbage, Homing => StageError::Unreadable { .. },
}}

fn cell(dialect: Dialect, what: FaultKind, when: When, expected: impl Fn(&StageError) -> bool) {
    let mut config = SimulatorConfig::of(dialect);
    // The recommended setting of grblHAL: otherwise its silence while homing is not a fault.
    config.report_mask |= 1 << 12;
    let bench = bench(config);
    let (mut stage, mut laser) = bench.open();
    bring_to(&bench, &mut stage, &mut laser, when);
    let begin = crate::time::now();
    trigger_event(&bench, dialect, what);
    wait_until(REPORT_LIMIT + SLACK, "the fault is reported", || {
        if matches!(when, When::Emitting | When::EmittingAndMoving) {
            laser.renew(Duration::from_secs(1)).ok();
        }
        stage.poll().is_err()
    });
    println!("{dialect:?} {what:?} {when:?}: reported after {:?}", crate::time::since(begin));
    let fault = stage.poll().unwrap_err();
    assert!(expected(&fault), "reported as: {fault}");
    assert!(stage.poll().is_err(), "reported once only");
    assert!(stage.start_move(0.0, 10.0).is_err(), "a move was accepted despite the fault");
    assert!(laser.switch_on(0.5, Duration::from_secs(1)).is_err(), "the laser was switched on despite the fault");
    let event_log = bench.simulator.event_log();
    let off_limit = if dialect == Dialect::FluidNc { LASER_OFF_LIMIT + FLUID_NC_PAUSES } else { LASER_OFF_LIMIT };
    wait_until(off_limit + SLACK, "it is off and at rest", || !event_log.light() && !event_log.moving());
    recovers_ready(&bench, &mut stage, &mut laser, what);
}

fn bring_to(bench: &Bench, stage: &mut GrblStage, laser: &mut GrblLaser, when: When) {
    home(stage);
    stage.start_move(-4.0, 100.0).unwrap();
    rest(stage);
    if matches!(when, When::Emitting | When::EmittingAndMoving) {
        laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
        wait_until(SLACK, "it is on", || bench.light());
    }
    match when {
        // Slow enough to last longer than any fault takes to be reported: 8 mm at 4 mm/s.
        When::Moving | When::EmittingAndMoving => drop(stage.start_move(4.0, 4.0).unwrap()),
        When::Homing => stage.start_home().unwrap(),
        When::Ready | When::Emitting => return,
    }
    wait_until(SLACK, "it moves", || bench.simulator.event_log().moving());
}

fn trigger_event(bench: &Bench, dialect: Dialect, what: FaultKind) {
    match what {
        FaultKind::Silence => bench.simulator.fail(LineFault::Silence),
        FaultKind::Garbage => bench.simulator.fail(LineFault::Garbage),
        FaultKind::HardLimit => bench.simulator.trigger_event(Event::Alarm(1)),
        FaultKind::Unplugged => bench.simulator.unplug(),
        FaultKind::Restart => bench.simulator.restart(),
        FaultKind::Stall => bench.simulator.trigger_event(Event::Stall),
        FaultKind::AnotherDevice => {
            bench.simulator.replug_as(SimulatorConfig { name: "another".into(), ..SimulatorConfig::of(dialect) })
        }
    }
}

/// The cause is removed and the fault acknowledged: no motion, laser off, and no position reported.
fn recovers_ready(bench: &Bench, stage: &mut GrblStage, laser: &mut GrblLaser, what: FaultKind) {
    let mark = bench.simulator.event_log().mark();
    match what {
        FaultKind::Unplugged => bench.simulator.replug(),
        _ => bench.simulator.repair(),
    }
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
    assert!(!laser.poll().unwrap().emitting, "the laser is on after the reconnection");
    assert!(!bench.light(), "the laser is on after the reconnection");
    assert_eq!(bench.simulator.event_log().n_motions_since(mark), 0, "a motion was repeated");
    home(stage);
    stage.start_move(1.0, 50.0).unwrap();
    let at_mm = rest(stage).position_mm.unwrap();
    assert!((at_mm - 1.0).abs() < 0.01, "homed and moved to 1 mm, and it is at {at_mm} mm");
}

#[test]
fn homing_that_never_ends_is_reported_at_the_homing_limit() {
    let mut bench = super::default_bench();
    bench.config.homing_limit = Duration::from_millis(400);
    let (mut stage, _laser) = bench.open();
    bench.simulator.trigger_event(Event::NoAcknowledgement);
    stage.start_home().unwrap();
    wait_until(Duration::from_millis(400) + SLACK, "the limit is noticed", || stage.poll().is_err());
    let fault = stage.poll().unwrap_err();
    assert!(matches!(&fault, StageError::NoResponse { command, .. } if command == "$H"), "{fault}");
}

#[test]
fn an_m5_that_is_not_acknowledged_is_followed_by_a_reset() {
    let bench = super::default_bench();
    let (_stage, mut laser) = bench.open();
    laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
    bench.simulator.trigger_event(Event::NoAcknowledgement);
    let mark = bench.simulator.event_log().mark();
    laser.switch_off().unwrap();
    wait_until(LASER_OFF_LIMIT + SLACK, "a reset follows", || {
        bench.simulator.event_log().byte_since(mark, crate::drivers::grbl::protocol::RESET).is_some()
    });
    assert!(!bench.light());
}

#[test]
fn garbage_in_place_of_answers_is_never_reported_as_silence() {
    let bench = super::default_bench();
    let (mut stage, mut laser) = bench.open();
    laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
    wait_until(SLACK, "it is on", || bench.light());
    // It begins while the driver awaits the acknowledgement of `M5`, and hides the banner of the reset that follows.
    bench.simulator.fail(LineFault::Garbage);
    laser.switch_off().unwrap();
    wait_until(REPORT_LIMIT + SLACK, "it is reported", || stage.poll().is_err());
    let fault = stage.poll().unwrap_err();
    assert!(matches!(fault, StageError::Unreadable { .. }), "reported as: {fault}");
    assert!(!bench.light());
}

#[test]
fn unrequested_light_is_reset_and_reported() {
    let bench = super::default_bench();
    let (stage, mut laser) = bench.open();
    bench.simulator.trigger_event(Event::StrayLight);
    wait_until(SLACK, "it is on", || bench.light());
    wait_until(REPORT_LIMIT + SLACK, "it is reported", || laser.poll().is_err());
    wait_until(LASER_OFF_LIMIT + SLACK, "it is off", || !bench.light());
    drop(stage);
}

#[test]
fn another_controller_at_the_same_port_is_refused_by_its_name() {
    let mut bench = super::default_bench();
    bench.config.expected_name = Some("simulated stage".into());
    let (mut stage, mut laser) = bench.open();
    bench.simulator.replug_as(SimulatorConfig { name: "another".into(), ..Default::default() });
    wait_until(REPORT_LIMIT + SLACK, "the change is noticed", || stage.poll().is_err());
    stage.reconnect().unwrap();
    wait_until(REPORT_LIMIT + SLACK, "it is reported", || {
        matches!(stage.poll(), Err(StageError::WrongDevice { .. }))
    });
    assert!(laser.poll().is_err(), "the laser of another controller was taken for ours");
}
