//! Commands on the line, acceptance of positions, and the effect of a stop.

use std::time::Duration;

use super::{Bench, RUN_OUT, SLACK, bench, default_bench, home, rest, wait_until};
use crate::simulators::marlin_simulator::{Event, SimulatorConfig};
use crate::simulators::simulator::{LineFault, LogEvent};
use crate::{Laser, LaserError, Stage, StageError};

const SECOND: Duration = Duration::from_secs(1);

fn received_since(bench: &Bench, mark: usize) -> String {
    let bytes = bench.simulator.event_log().since(mark).into_iter().filter_map(|entry| match entry.what {
        LogEvent::Byte(byte) => Some(byte),
        _ => None,
    });
    String::from_utf8(bytes.collect()).unwrap()
}

#[test]
fn identity_and_capabilities_are_read_from_the_device() {
    let (stage, laser) = default_bench().open();
    let (identity, can) = (stage.identity(), stage.capabilities());
    assert_eq!((identity.driver, identity.model.as_str()), ("marlin", "Simulated stage"));
    assert_eq!(identity.firmware, "Marlin 2.1.2.4");
    assert!(identity.serial.starts_with("cede2a2f"), "{identity:?}");
    assert_eq!((can.max_speed_mm_s, can.acceleration_mm_s2), (200.0, Some(3000.0)));
    assert_eq!(laser.identity(), identity);
    assert!(laser.lost_host().contains("LASER_SAFETY_TIMEOUT_MS"));
}

#[test]
fn a_board_without_emergency_parser_is_refused_with_the_build_option() {
    let refusal = bench(SimulatorConfig { emergency_parser: false, ..SimulatorConfig::default() }).refusal();
    assert!(
        matches!(&refusal, StageError::WrongDevice { found, .. } if found.contains("EMERGENCY_PARSER")),
        "{refusal}"
    );
}

#[test]
fn other_steps_a_travel_too_long_another_name_and_another_firmware_are_refused() {
    let mut bench = default_bench();
    bench.config.steps_per_mm = 100.0;
    let refusal = bench.refusal();
    assert!(matches!(&refusal, StageError::WrongDevice { expected, .. } if expected.contains("M92")), "{refusal}");
    bench.config.steps_per_mm = 80.0;
    bench.config.travel_mm = (-4.0, 95.0);
    let refusal = bench.refusal();
    assert!(
        matches!(&refusal, StageError::WrongDevice { expected, .. } if expected.contains("101 mm")),
        "{refusal}"
    );
    bench.config.travel_mm = (-4.0, 4.0);
    bench.config.expected_name = Some("stage 7".to_owned());
    let refusal = bench.refusal();
    assert!(
        matches!(&refusal, StageError::WrongDevice { expected, .. } if expected.contains("stage 7")),
        "{refusal}"
    );
    bench.config.expected_name = None;
    bench.config.open_limit = Duration::from_millis(1500);
    bench.simulator.fail(LineFault::Garbage);
    let refusal = bench.refusal();
    assert!(matches!(refusal, StageError::WrongDevice { .. }), "{refusal}");
    bench.simulator.fail(LineFault::Silence);
    let refusal = bench.refusal();
    assert!(matches!(refusal, StageError::NoResponse { .. }), "{refusal}");
}

#[test]
fn opening_stops_motion_and_turns_off_a_laser_left_on_by_a_terminated_program() {
    let bench = bench(SimulatorConfig { laser_timeout_ms: 0, ..SimulatorConfig::default() });
    // It starts first.
    crate::time::sleep(Duration::from_millis(60));
    bench.simulator.receive(b"M3 S255\nG1 X90 F300\n");
    wait_until(SECOND, "it moves with the laser on", || bench.moving() && bench.light());
    let (mut stage, mut laser) = bench.open();
    assert!(!bench.moving() && !bench.light(), "opened, and it moves or the laser is on");
    assert!(!stage.poll().unwrap().moving && !laser.poll().unwrap().emitting);
}

#[test]
fn opening_waits_for_a_board_that_restarts_with_its_port() {
    let bench = bench(SimulatorConfig { boot: Duration::from_millis(1200), ..SimulatorConfig::default() });
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
}

#[test]
fn a_damaged_line_is_resent_and_executed_once() {
    for ok_after_resend in [false, true] {
        let bench = bench(SimulatorConfig { ok_after_resend, ..SimulatorConfig::default() });
        let (mut stage, _laser) = bench.open();
        home(&mut stage);
        for target_mm in [-3.0, 3.0, -1.0] {
            bench.simulator.trigger_event(Event::DamageNextLine);
            stage.start_move(target_mm, 20.0).unwrap();
            let at_mm = rest(&mut stage).position_mm.unwrap();
            assert!((at_mm - target_mm).abs() < 0.03, "at {at_mm} mm, not at {target_mm} mm");
        }
    }
}

#[test]
fn a_stop_completes_the_pieces_sent_and_keeps_the_position() {
    let bench = default_bench();
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    let mut longest = Duration::ZERO;
    for _ in 0..12 {
        stage.start_move(-4.0, 100.0).unwrap();
        rest(&mut stage);
        stage.start_move(4.0, 8.0).unwrap();
        wait_until(SLACK, "it moves", || bench.moving());
        crate::time::sleep(Duration::from_millis(120));
        let begun_at = crate::time::now();
        stage.stop().unwrap();
        wait_until(RUN_OUT, "it rests", || !bench.moving());
        longest = longest.max(crate::time::since(begun_at));
        let state = rest(&mut stage);
        let mark = bench.simulator.event_log().mark();
        assert!(state.homed && state.position_mm.unwrap() < 3.0, "{state:?}");
        crate::time::sleep(Duration::from_millis(150));
        let received = received_since(&bench, mark);
        assert!(!received.contains("G1"), "a piece was sent after the stop: {received}");
        assert_eq!(bench.simulator.event_log().n_motions_since(mark), 0, "it moved after the stop");
    }
    println!("Stop of a move at 8 mm/s: at rest after at most {longest:?}");
}

#[test]
fn pieces_are_sent_only_a_short_time_ahead() {
    let bench = bench(SimulatorConfig { acceleration_mm_s2: 500.0, ..SimulatorConfig::default() });
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    stage.start_move(-4.0, 40.0).unwrap();
    rest(&mut stage);
    let mark = bench.simulator.event_log().mark();
    stage.start_move(4.0, 10.0).unwrap();
    wait_until(SECOND, "it moves", || bench.moving());
    crate::time::sleep(Duration::from_millis(200));
    // If the computer loses power, the stage runs to here.
    let sent = received_since(&bench, mark);
    let last_mm: f64 = sent
        .lines()
        .filter_map(|line| line.split("G1 X").nth(1)?.split(' ').next()?.parse().ok())
        .fold(0.0, f64::max);
    let at_mm = stage.poll().unwrap().position_mm.unwrap() + 6.0;
    // Pieces of 0.11 s at 10 mm/s, the braking distance, one piece, and one report's age.
    assert!(last_mm - at_mm < 1.1 + 0.13 + 0.4 + 0.4, "sent up to {last_mm} mm, and it is at {at_mm} mm");
    stage.stop().unwrap();
    rest(&mut stage);
}

#[test]
fn a_stop_while_homing_halts_the_controller_at_once_with_a_remedy() {
    let bench = bench(SimulatorConfig { homing_mm_s: 2.0, ..SimulatorConfig::default() });
    let (mut stage, _laser) = bench.open();
    stage.start_home().unwrap();
    wait_until(SECOND, "it moves", || bench.moving());
    stage.stop().unwrap();
    wait_until(Duration::from_millis(200), "it rests", || !bench.moving());
    let fault = stage.poll().unwrap_err();
    assert!(fault.to_string().contains("press its reset button"), "{fault}");
    bench.simulator.trigger_event(Event::ResetButton);
    stage.reconnect().unwrap();
    wait_until(Duration::from_secs(5), "it is reconnected", || stage.poll().is_ok());
    assert!(!stage.poll().unwrap().homed);
}

#[test]
fn pieces_not_completed_in_time_are_dropped_and_the_position_is_lost() {
    let bench = default_bench();
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    stage.start_move(-4.0, 100.0).unwrap();
    rest(&mut stage);
    stage.start_move(4.0, 8.0).unwrap();
    wait_until(SLACK, "it moves", || bench.moving());
    bench.simulator.trigger_event(Event::Stuck);
    let mark = bench.simulator.event_log().mark();
    stage.stop().unwrap();
    wait_until(2 * SECOND, "a quick stop follows", || received_since(&bench, mark).contains("M410"));
    wait_until(4 * SECOND, "it rests", || stage.poll().is_ok_and(|state| !state.moving));
    let state = stage.poll().unwrap();
    assert!(!state.homed && state.position_mm.is_none(), "{state:?}");
}

#[test]
fn a_laser_on_at_rest_is_kept_on_beyond_the_firmwares_timeout() {
    let bench = default_bench();
    let (_stage, mut laser) = bench.open();
    laser.switch_on(0.5, SECOND).unwrap();
    wait_until(SLACK, "it is on", || bench.light());
    let begun_at = crate::time::now();
    while crate::time::since(begun_at) < Duration::from_millis(1800) {
        laser.renew(SECOND).unwrap();
        assert!(bench.light(), "the firmware's timeout turned a renewed laser off");
        crate::time::sleep(Duration::from_millis(20));
    }
}

#[test]
fn turning_the_laser_off_while_moving_stops_the_move() {
    let bench = default_bench();
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    stage.start_move(-4.0, 100.0).unwrap();
    rest(&mut stage);
    laser.switch_on(0.5, SECOND).unwrap();
    stage.start_move(4.0, 4.0).unwrap();
    wait_until(SLACK, "it moves with the laser on", || bench.moving() && bench.light());
    laser.switch_off().unwrap();
    wait_until(Duration::from_millis(500), "it is off", || !bench.light());
    assert!(!bench.moving(), "off, but it still moves");
    let state = rest(&mut stage);
    assert!(state.homed && state.position_mm.unwrap() < 3.0, "{state:?}");
}

#[test]
fn the_laser_is_not_switched_on_while_the_stage_moves() {
    let bench = default_bench();
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    stage.start_move(4.0, 4.0).unwrap();
    let refusal = laser.switch_on(0.5, SECOND);
    assert!(matches!(refusal, Err(LaserError::Fault { .. } | LaserError::Controller(_))), "{refusal:?}");
    stage.stop().unwrap();
    rest(&mut stage);
}

#[test]
fn a_firmware_without_laser_refuses_to_turn_it_on() {
    let bench = bench(SimulatorConfig { laser: false, ..SimulatorConfig::default() });
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    let refusal = laser.switch_on(0.5, SECOND);
    let said = refusal.expect_err("it has no laser").to_string();
    assert!(said.contains("unknown command"), "{said}");
    stage.start_move(1.0, 20.0).unwrap();
    rest(&mut stage);
}

#[test]
fn an_m5_that_is_not_acknowledged_is_followed_by_m112() {
    let bench = bench(SimulatorConfig { laser_timeout_ms: 0, ..SimulatorConfig::default() });
    let (mut stage, mut laser) = bench.open();
    laser.switch_on(0.5, SECOND).unwrap();
    wait_until(SLACK, "it is on", || bench.light());
    bench.simulator.trigger_event(Event::NoAcknowledgement);
    let mark = bench.simulator.event_log().mark();
    laser.switch_off().ok();
    wait_until(Duration::from_millis(500) + SLACK, "it is halted", || {
        received_since(&bench, mark).contains("M112")
    });
    wait_until(SLACK, "it is off", || !bench.light());
    assert!(stage.poll().is_err());
}
