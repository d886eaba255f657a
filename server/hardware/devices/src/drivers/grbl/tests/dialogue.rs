//! Checks when a controller is opened, and the commands sent to it.

use std::time::Duration;

use super::{bench, default_bench, home, rest, wait_until};
use crate::simulators::grbl_simulator::{Dialect, Event, GrblSimulator, LogEvent, SimulatorConfig};
use crate::simulators::simulator::LineFault;
use crate::{Laser, LaserError, Stage, StageError};

#[test]
fn an_override_changed_at_the_machine_is_reset_together_with_the_laser_power() {
    for dialect in Dialect::ALL {
        let bench = bench(SimulatorConfig::of(dialect));
        let (mut stage, mut laser) = bench.open();
        home(&mut stage);
        laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
        let mark = bench.simulator.event_log().mark();
        bench.simulator.trigger_event(Event::Override(0x9b));
        wait_until(Duration::from_secs(1), "it is set back", || {
            laser.renew(Duration::from_secs(1)).unwrap();
            let since = bench.simulator.event_log().since(mark);
            let powers = since.iter().filter_map(|entry| match entry.what {
                LogEvent::LightOn(power) => Some(power),
                _ => None,
            });
            powers.collect::<Vec<_>>() == [0.45, 0.5]
        });
    }
}

#[test]
fn identity_and_capabilities_are_read_from_the_controller() {
    let bench = default_bench();
    let (stage, _laser) = bench.open();
    let identity = stage.identity();
    assert_eq!((identity.model.as_str(), identity.serial.as_str()), ("Grbl", "simulated stage"));
    assert_eq!(identity.firmware, "1.1h.20190825");
    let capabilities = stage.capabilities();
    assert_eq!(
        (capabilities.travel_mm, capabilities.max_speed_mm_s, capabilities.resolution_mm),
        ((-4.0, 4.0), 200.0, 1.0 / 400.0)
    );
}

#[test]
fn a_controller_that_differs_from_the_configuration_is_refused_with_the_difference() {
    let default = SimulatorConfig::default;
    for (kind, found) in [
        (SimulatorConfig { inches: true, ..default() }, "$13=1"),
        (SimulatorConfig { steps_per_mm: 80.0, ..default() }, "80"),
        (SimulatorConfig { laser_mode: 0, ..default() }, "$32=0"),
        (SimulatorConfig { laser_mode: 2, ..SimulatorConfig::of(Dialect::GrblHal) }, "lathe mode: send $32=1"),
        (SimulatorConfig { max_travel_mm: 5.0, ..default() }, "-5 to 0 mm"),
    ] {
        let refusal = bench(kind).refusal();
        let StageError::WrongDevice { found: reported, .. } = &refusal else { panic!("{refusal}") };
        assert!(reported.contains(found), "{refusal}");
    }
}

#[test]
fn a_controller_of_another_name_is_refused() {
    // A part of a longer word is another name.
    for other in ["stage 7", "simulated stag"] {
        let mut bench = default_bench();
        bench.config.expected_name = Some(other.into());
        let refusal = bench.refusal().to_string();
        assert!(refusal.contains(&format!("`{other}`")) && refusal.contains("simulated stage"), "{refusal}");
    }
}

#[test]
fn a_controller_is_identified_by_any_line_of_its_build_information() {
    for (dialect, known_by) in [
        (Dialect::Grbl, "simulated stage"),
        (Dialect::Grbl, "VER:1.1h.20190825:simulated stage"),
        (Dialect::GrblHal, "simulated stage"),
        (Dialect::GrblHal, "Simulated board 7"),
        (Dialect::GrblHal, "grblHAL"),
        (Dialect::FluidNc, "simulated stage"),
        (Dialect::FluidNc, "Simulated board 7"),
    ] {
        let mut bench = bench(SimulatorConfig::of(dialect));
        bench.config.expected_name = Some(known_by.into());
        let model = bench.open().0.identity().model;
        assert_eq!(model, ["Grbl", "grblHAL", "FluidNC"][dialect as usize], "{known_by}");
    }
}

#[test]
fn another_device_is_refused_within_a_second_with_its_message() {
    let bench = bench(SimulatorConfig { banner: "Marlin 2.1.2".into(), ..SimulatorConfig::default() });
    let watch = crate::contract::Stopwatch::start();
    let refusal = bench.refusal();
    assert!(matches!(&refusal, StageError::WrongDevice { found, .. } if found.contains("Marlin")), "{refusal}");
    assert!(watch.own_time() < Duration::from_secs(1) + super::SLACK, "refused after {:?}", watch.own_time());
}

#[test]
fn a_silent_controller_and_a_missing_port_are_distinguished() {
    let mut bench = default_bench();
    bench.config.open_limit = Duration::from_millis(300);
    bench.simulator.fail(LineFault::Silence);
    assert!(matches!(bench.refusal(), StageError::NoResponse { .. }));
    bench.config.port.push_str("-elsewhere");
    assert!(matches!(bench.refusal(), StageError::Disconnected { .. }));
}

#[test]
fn opening_stops_motion_and_turns_off_a_laser_left_on_by_a_terminated_program() {
    let bench = default_bench();
    bench.simulator.receive(b"$X\nG1F600M3S1000\nG90G53G1X-90F60\n");
    wait_until(Duration::from_secs(1), "it moves with the laser on", || {
        bench.light() && bench.simulator.event_log().moving()
    });
    let (mut stage, mut laser) = bench.open();
    assert!(
        !bench.light() && !bench.simulator.event_log().moving(),
        "opened, and the laser is still on or it moves"
    );
    let state = stage.poll().unwrap();
    assert!(!state.homed && !state.moving, "{state:?}");
    assert!(!laser.poll().unwrap().emitting);
    home(&mut stage);
}

#[test]
fn a_move_reaches_its_target_on_the_scale() {
    let bench = default_bench();
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    stage.start_move(2.5, 50.0).unwrap();
    rest(&mut stage);
    let ends = |happening: LogEvent| match happening {
        LogEvent::MotionEnded(at_mm) => Some(at_mm),
        _ => None,
    };
    let entries = bench.simulator.event_log().entries();
    let machine_mm = entries.iter().rev().find_map(|entry| ends(entry.what)).unwrap();
    assert_eq!(machine_mm, -3.5, "2.5 mm from a zero at -6 mm");
}

#[test]
fn positions_in_motion_are_timestamped_to_a_fraction_of_the_response_time() {
    let bench = default_bench();
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    stage.start_move(-4.0, 50.0).unwrap();
    rest(&mut stage);
    let mark = bench.simulator.event_log().mark();
    stage.start_move(4.0, 20.0).unwrap();
    let mut seen = Vec::new();
    loop {
        let state = stage.poll().unwrap();
        if !state.moving {
            break;
        }
        seen.push((state.measured_at, state.position_mm.unwrap()));
        crate::time::sleep(Duration::from_millis(5));
    }
    let began = bench.simulator.event_log().since(mark);
    let began = began.iter().find(|entry| matches!(entry.what, LogEvent::MotionBegan(_))).unwrap().at;
    // While it cruises it is at v·t − v²/2a. 20 mm/s over 15 ms of latency on a loaded machine are 0.3 mm.
    let (speed_mm_s, lag_mm, tolerance_mm) = (20.0, 20.0 * 20.0 / (2.0 * 5000.0), 0.3);
    let mut n_cruising = 0;
    for (at, position_mm) in seen {
        let expected_mm = -4.0 + speed_mm_s * at.saturating_duration_since(began).as_secs_f64() - lag_mm;
        if (-3.5..3.5).contains(&position_mm) {
            assert!((position_mm - expected_mm).abs() < tolerance_mm, "{position_mm} mm, expected {expected_mm}");
            n_cruising += 1;
        }
    }
    assert!(n_cruising > 10, "{n_cruising} positions seen on the way");
}

#[test]
fn a_soft_limit_alarm_keeps_the_position_and_every_other_alarm_loses_it() {
    for (code, kept) in [(2, true), (1, false), (9, false)] {
        let bench = default_bench();
        let (mut stage, _laser) = bench.open();
        home(&mut stage);
        let before = stage.poll().unwrap().position_mm;
        bench.simulator.trigger_event(Event::Alarm(code));
        wait_until(Duration::from_secs(1), "the alarm is reported", || stage.poll().is_err());
        let fault = stage.poll().unwrap_err();
        assert!(matches!(fault, StageError::Alarm { code: reported, .. } if reported == code), "{fault}");
        stage.clear_fault().unwrap();
        wait_until(Duration::from_secs(2), "the alarm is cleared", || stage.poll().is_ok());
        let after = stage.poll().unwrap().position_mm;
        assert_eq!(after, before.filter(|_| kept), "after alarm {code}");
    }
}

#[test]
fn a_machine_with_less_travel_at_the_same_port_is_refused() {
    let bench = default_bench();
    let (mut stage, _laser) = bench.open();
    bench.simulator.replug_as(SimulatorConfig { max_travel_mm: 3.0, ..SimulatorConfig::default() });
    wait_until(Duration::from_secs(1), "the change is noticed", || stage.poll().is_err());
    stage.reconnect().unwrap();
    wait_until(Duration::from_secs(2), "refused", || matches!(stage.poll(), Err(StageError::WrongDevice { .. })));
}

#[test]
fn the_laser_is_not_switched_while_the_stage_moves() {
    let bench = default_bench();
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    stage.start_move(4.0, 20.0).unwrap();
    let refusal = laser.switch_on(0.5, Duration::from_secs(1));
    assert!(matches!(refusal, Err(LaserError::Fault { .. })), "{refusal:?}");
    rest(&mut stage);
    assert!(!bench.light());
}

#[test]
fn a_lease_that_ends_during_a_move_turns_the_laser_off_by_stopping_it() {
    let bench = default_bench();
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    stage.start_move(-4.0, 100.0).unwrap();
    rest(&mut stage);
    laser.switch_on(1.0, Duration::from_millis(150)).unwrap();
    stage.start_move(4.0, 10.0).unwrap();
    wait_until(Duration::from_millis(150 + 500) + super::SLACK, "off after the lease", || !bench.light());
    let state = rest(&mut stage);
    assert!(state.position_mm.unwrap() < 3.0, "the move went on: {state:?}");
    assert!(!laser.poll().unwrap().emitting);
}

#[test]
fn an_error_of_the_controller_is_reported_with_its_meaning() {
    let bench = bench(SimulatorConfig { axis: 'Y', ..SimulatorConfig::default() });
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    // The driver uses X, which this controller does not have.
    let refusal = stage.start_move(1.0, 10.0).unwrap_err();
    assert!(matches!(refusal, StageError::Refused { code: 20, .. }), "{refusal}");
    assert!(!stage.poll().unwrap().moving, "refused, but it reports motion");
}

#[test]
fn an_event_log_file_can_be_read_by_another_process() {
    let folder = tempfile::TempDir::new().unwrap();
    let (port_name, file) = (folder.path().join("controller"), folder.path().join("event_log"));
    let simulator = GrblSimulator::start(SimulatorConfig::default(), &port_name, Some(&file)).unwrap();
    let config = crate::drivers::grbl::GrblConfig {
        zero_at_machine_mm: -6.0,
        ..crate::drivers::grbl::GrblConfig::new(port_name.to_str().unwrap(), super::STEPS_PER_MM, (-4.0, 4.0))
    };
    let (_stage, mut laser) = crate::drivers::grbl::open(&config).unwrap();
    laser.switch_on(0.25, Duration::from_secs(1)).unwrap();
    laser.switch_off().unwrap();
    wait_until(Duration::from_secs(1), "laser off", || !simulator.event_log().light());
    let text = std::fs::read_to_string(&file).unwrap();
    let light: Vec<&str> = text.lines().filter_map(|line| line.split_once(' ')).map(|(_, what)| what).collect();
    let light: Vec<&str> = light.into_iter().filter(|what| what.starts_with("light")).collect();
    assert_eq!(light, ["light-on 0.25", "light-off"]);
}
