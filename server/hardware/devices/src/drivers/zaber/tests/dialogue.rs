//! Commands on the line, and acceptance of answers.

use std::time::Duration;

use super::{SLACK, bench, default_bench, home, rest, wait_until};
use crate::contract::Stopwatch;
use crate::simulators::simulator::LogEvent;
use crate::simulators::zaber_simulator::{Event, SimulatorConfig};
use crate::{Stage, StageError, StageKind};

fn received_since(bench: &super::Bench, mark: usize) -> String {
    let bytes = bench.simulator.event_log().since(mark).into_iter().filter_map(|entry| match entry.what {
        LogEvent::Byte(byte) => Some(byte),
        _ => None,
    });
    String::from_utf8(bytes.collect()).unwrap()
}

#[test]
fn identity_and_capabilities_are_read_in_millimetres() {
    let stage = default_bench().open();
    let (identity, can) = (stage.identity(), stage.capabilities());
    assert_eq!((identity.driver, identity.model.as_str()), ("zaber", "device 50422"));
    assert_eq!((identity.serial.as_str(), identity.firmware.as_str()), ("80001", "7.38"));
    assert_eq!((can.kind, can.travel_mm), (StageKind::Linear, (-4.0, 4.0)));
    // 2 mm per turn of 200 × 64 microsteps.
    assert!((can.resolution_mm - 2.0 / 12_800.0).abs() < 1e-12, "{can:?}");
    assert!((can.max_speed_mm_s - 200.0).abs() < 0.01, "{can:?}");
    assert!((can.acceleration_mm_s2.unwrap() - 5000.0).abs() < 5.0, "{can:?}");
}

#[test]
fn commands_address_the_axis_alone_and_have_a_checksum() {
    let bench = bench(SimulatorConfig { address: 7, n_axes: 2, ..SimulatorConfig::default() });
    let mut stage = bench.open();
    home(&mut stage);
    stage.start_move(1.0, 20.0).unwrap();
    rest(&mut stage);
    for line in received_since(&bench, 0).lines().filter(|line| !line.is_empty()) {
        assert!(line.starts_with("/07 "), "{line} is not addressed to the axis");
        assert!(line.rsplit_once(':').is_some_and(|(_, sum)| sum.len() == 2), "{line} has no checksum");
        let of_axis = ["move", "home", "stop", "get pos", "warnings"].iter().any(|word| line.contains(word));
        assert_eq!(
            line.starts_with("/07 1 "),
            of_axis
                || line.contains("resolution")
                || line.contains("limit")
                || line.contains("maxspeed")
                || line.contains("accel"),
            "{line}"
        );
    }
}

#[test]
fn checksums_of_replies_are_enabled_and_written_only_once() {
    let bench = default_bench();
    drop(bench.open());
    assert!(received_since(&bench, 0).contains("set comm.checksum 1"));
    let mark = bench.simulator.event_log().mark();
    drop(bench.open());
    assert!(!received_since(&bench, mark).contains("set comm.checksum"));
}

#[test]
fn another_serial_number_a_missing_axis_and_a_travel_too_long_are_refused() {
    let mut bench = default_bench();
    bench.config.expected_serial = Some(12_345);
    let refusal = bench.refusal();
    assert!(
        matches!(&refusal, StageError::WrongDevice { expected, found, .. }
        if expected.contains("12345") && found.contains("80001")),
        "{refusal}"
    );
    bench.config.expected_serial = None;
    bench.config.axis = 2;
    let refusal = bench.refusal();
    assert!(matches!(&refusal, StageError::WrongDevice { found, .. } if found.contains("BADAXIS")), "{refusal}");
    bench.config.axis = 1;
    bench.config.travel_mm = (-4.0, 95.0);
    let refusal = bench.refusal();
    assert!(
        matches!(&refusal, StageError::WrongDevice { expected, .. } if expected.contains("101 mm")),
        "{refusal}"
    );
}

#[test]
fn firmware_without_a_speed_parameter_of_moves_is_refused_with_a_remedy() {
    let bench = bench(SimulatorConfig { version: 6.32, ..SimulatorConfig::default() });
    let refusal = bench.refusal();
    assert!(matches!(&refusal, StageError::WrongDevice { found, .. } if found.contains("update")), "{refusal}");
}

#[test]
fn a_silent_device_and_a_missing_port_are_distinguished() {
    let mut bench = default_bench();
    bench.config.open_limit = Duration::from_millis(400);
    bench.simulator.fail(crate::simulators::simulator::LineFault::Silence);
    let refusal = bench.refusal();
    assert!(matches!(refusal, StageError::NoResponse { .. }), "{refusal}");
    bench.config.port = "/nowhere/tty".to_owned();
    let refusal = bench.refusal();
    assert!(matches!(refusal, StageError::Disconnected { .. }), "{refusal}");
}

#[test]
fn a_motion_left_by_a_terminated_program_is_stopped_when_the_device_is_opened() {
    let bench = bench(SimulatorConfig { homing_mm_s: 2.0, start_at_mm: 90.0, ..SimulatorConfig::default() });
    bench.simulator.receive(b"/1 1 home\n");
    wait_until(SLACK, "it moves", || bench.moving());
    let mut again = bench.open();
    assert!(!bench.moving() && !again.poll().unwrap().moving, "opened, and it moves");
}

#[test]
fn stops_reach_the_device_in_time_during_polls_and_no_move_follows() {
    let bench = default_bench();
    let mut stage = bench.open();
    home(&mut stage);
    let mut waits = Vec::new();
    for _ in 0..60 {
        stage.start_move(-4.0, 100.0).unwrap();
        rest(&mut stage);
        stage.start_move(4.0, 8.0).unwrap();
        wait_until(SLACK, "it moves", || bench.moving());
        let (mark, begun_at, watch) = (bench.simulator.event_log().mark(), crate::time::now(), Stopwatch::start());
        stage.stop().unwrap();
        wait_until(SLACK, "it rests", || !bench.moving());
        waits.push(watch.own_time());
        let state = rest(&mut stage);
        assert!(state.homed && state.position_mm.is_some(), "a stop lost the position: {state:?}");
        let received = received_since(&bench, mark);
        assert!(received.contains(" stop:"), "{received}");
        assert!(
            !received.rsplit_once(" stop:").unwrap().1.contains("move"),
            "a move came after the stop: {received}"
        );
        assert!(crate::time::since(begun_at) < Duration::from_secs(2));
    }
    waits.sort();
    // `promises.md`: 200 ms at most; the ramp from 8 mm/s takes 2 ms.
    assert!(waits[waits.len() - 1] < Duration::from_millis(200), "stopped after {waits:?}");
}

#[test]
fn a_move_refused_by_the_emergency_stop_is_the_fault_of_its_flag() {
    let bench = default_bench();
    let mut stage = bench.open();
    home(&mut stage);
    // Pressed between two polls: the driver requests a move in the meantime.
    bench.simulator.trigger_event(Event::EmergencyStop);
    let refusal = stage.start_move(1.0, 10.0);
    assert!(matches!(&refusal, Err(StageError::Warned { flag, .. }) if flag == "FH"), "{refusal:?}");
    let fault = stage.poll();
    assert!(matches!(&fault, Err(StageError::Warned { flag, .. }) if flag == "FH"), "{fault:?}");
}
