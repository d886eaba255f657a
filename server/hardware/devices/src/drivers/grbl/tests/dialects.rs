//! Differences of the three firmwares, and the same behaviour for the operator.

use std::time::{Duration, Instant};

use super::{Bench, SLACK, bench, home, rest, wait_until};
use crate::drivers::grbl::protocol::{HOLD, JOG_CANCEL, RESET};
use crate::drivers::grbl::{GrblConfig, GrblStage};
use crate::params::GRBL_SILENCE;
use crate::simulators::grbl_simulator::{Dialect, Event, LogEvent, SimulatorConfig};
use crate::{Laser, LaserError, Stage, StageError};

/// `promises.md` 5: a released jog stops within this, braking included.
const JOG_LIMIT: Duration = Duration::from_millis(300);

/// A bench whose stage is homed and at -4 mm.
fn at_the_low_end(dialect: Dialect) -> (Bench, GrblStage) {
    let bench = bench(SimulatorConfig::of(dialect));
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    stage.start_move(-4.0, 100.0).unwrap();
    rest(&mut stage);
    (bench, stage)
}

/// When it came to rest since the mark.
fn rested_at(bench: &Bench, mark: usize) -> Instant {
    let ended = || {
        let entries = bench.simulator.event_log().since(mark);
        entries.iter().find(|entry| matches!(entry.what, LogEvent::MotionEnded(_))).map(|entry| entry.at)
    };
    wait_until(Duration::from_secs(4), "it comes to rest", || ended().is_some());
    ended().unwrap()
}

#[test]
fn a_released_jog_stops_at_once_and_keeps_the_position_without_a_reset() {
    for dialect in Dialect::ALL {
        for by_hold in [false, true] {
            let (bench, mut stage) = at_the_low_end(dialect);
            stage.start_jog(8.0, 4.0).unwrap();
            wait_until(SLACK, "it jogs", || bench.simulator.event_log().moving());
            // The jog is acknowledged.
            wait_until(SLACK, "it is moving", || stage.poll().unwrap().position_mm.unwrap() > -3.95);
            let mark = bench.simulator.event_log().mark();
            let released_at = crate::time::now();
            if by_hold {
                stage.hold().unwrap()
            } else {
                stage.stop().unwrap()
            }
            let took = rested_at(&bench, mark).saturating_duration_since(released_at);
            println!("{dialect:?}: at rest {took:?} after the jog was released");
            assert!(took < JOG_LIMIT, "{dialect:?}: {took:?}");
            let state = rest(&mut stage);
            assert!(state.homed && state.position_mm.unwrap() < 0.0, "{dialect:?}: {state:?}");
            let event_log = bench.simulator.event_log();
            assert!(event_log.byte_since(mark, RESET).is_none(), "{dialect:?}: an unnecessary reset");
            stage.start_move(1.0, 50.0).unwrap();
            assert!((rest(&mut stage).position_mm.unwrap() - 1.0).abs() < 0.01);
        }
    }
}

#[test]
fn a_stop_is_a_hold_and_a_jog_cancel_and_one_reset_at_rest() {
    for dialect in Dialect::ALL {
        let (bench, mut stage) = at_the_low_end(dialect);
        stage.start_move(4.0, 10.0).unwrap();
        wait_until(SLACK, "it is moving", || stage.poll().unwrap().position_mm.unwrap() > -3.9);
        let mark = bench.simulator.event_log().mark();
        // Requested twice: the second is not a reset in motion.
        stage.stop().unwrap();
        stage.stop().unwrap();
        let state = rest(&mut stage);
        assert!(state.homed, "{dialect:?}: a stop lost the position");
        let entries = bench.simulator.event_log().since(mark);
        let at = |what: LogEvent| entries.iter().position(|entry| entry.what == what);
        let rested = entries.iter().position(|entry| matches!(entry.what, LogEvent::MotionEnded(_))).unwrap();
        assert!(at(LogEvent::Byte(HOLD)).unwrap() < rested, "{dialect:?}: {entries:?}");
        assert_eq!(at(LogEvent::Byte(HOLD)).map(|at| at + 1), at(LogEvent::Byte(JOG_CANCEL)), "{dialect:?}");
        let resets = entries.iter().filter(|entry| entry.what == LogEvent::Byte(RESET)).count();
        assert!(resets == 1 && at(LogEvent::Byte(RESET)).unwrap() > rested, "{dialect:?}: {entries:?}");
    }
}

#[test]
fn a_limit_alarm_is_reset_once_resets_are_accepted_and_can_be_cleared() {
    for dialect in Dialect::ALL {
        let (bench, mut stage) = at_the_low_end(dialect);
        bench.simulator.trigger_event(Event::Alarm(1));
        wait_until(SLACK, "it is reported", || matches!(stage.poll(), Err(StageError::Alarm { code: 1, .. })));
        // At once: the caller does not know about the pause.
        stage.clear_fault().unwrap();
        wait_until(Duration::from_secs(3), "it is cleared", || stage.poll().is_ok());
        assert!(!stage.poll().unwrap().homed, "{dialect:?}: homed after a limit switch");
        home(&mut stage);
    }
}

#[test]
fn a_failed_probe_turns_the_laser_off_and_is_a_fault() {
    for dialect in Dialect::ALL {
        let bench = bench(SimulatorConfig::of(dialect));
        let (mut stage, mut laser) = bench.open();
        home(&mut stage);
        laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
        wait_until(SLACK, "it is on", || bench.light());
        bench.simulator.trigger_event(Event::Alarm(4));
        wait_until(SLACK, "it is reported", || matches!(stage.poll(), Err(StageError::Alarm { code: 4, .. })));
        // The pause after the alarm is the firmware's.
        wait_until(Duration::from_millis(500) + SLACK, "it is off", || !bench.light());
    }
}

#[test]
fn the_silence_of_grbl_hal_while_homing_is_tolerated_and_no_setting_is_written() {
    let slow = SimulatorConfig { homing_mm_s: 4.0, start_at_mm: -8.0, ..SimulatorConfig::of(Dialect::GrblHal) };
    let bench = bench(slow);
    let (mut stage, _laser) = bench.open();
    let begun_at = crate::time::now();
    home(&mut stage);
    assert!(crate::time::since(begun_at) > GRBL_SILENCE);
    let received = String::from_utf8_lossy(&bytes_received(&bench)).into_owned();
    assert!(!received.contains('='), "a setting was written: {received:?}");
}

#[test]
fn grbl_hal_with_unusable_report_settings_is_refused_with_the_command_to_send() {
    let of = || SimulatorConfig::of(Dialect::GrblHal);
    // Neither machine positions nor the work offset; work positions with the offset are sufficient.
    let no_position = bench(SimulatorConfig { report_mask: 511 & !(1 | 1 << 5), ..of() });
    assert!(no_position.refusal().to_string().contains("send $10=479"), "{}", no_position.refusal());
    let by_work_offset = bench(SimulatorConfig { report_mask: 510, ..of() });
    // The offset comes with the tenth report; the driver is ready as soon as it is open.
    home(&mut by_work_offset.open().0);
    let no_realtime = bench(SimulatorConfig { realtime_in_commands: false, ..of() });
    assert!(no_realtime.refusal().to_string().contains("send $39=1"), "{}", no_realtime.refusal());
}

fn bytes_received(bench: &Bench) -> Vec<u8> {
    let byte = |happening: LogEvent| match happening {
        LogEvent::Byte(byte) => Some(byte),
        _ => None,
    };
    bench.simulator.event_log().entries().into_iter().filter_map(|entry| byte(entry.what)).collect()
}

#[test]
fn a_homing_lock_offers_homing_and_nothing_else() {
    let bench = bench(SimulatorConfig { homing_lock: true, ..SimulatorConfig::of(Dialect::GrblHal) });
    let (mut stage, mut laser) = bench.open();
    wait_until(SLACK + GRBL_SILENCE, "the lock is known", || {
        let refusal = laser.switch_on(0.5, Duration::from_millis(100));
        matches!(&refusal, Err(LaserError::Fault { remedy: "home the stage", .. }))
    });
    assert!(stage.poll().is_ok(), "a lock that homing opens is not a fault");
    home(&mut stage);
    laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
    wait_until(SLACK, "it is on", || bench.light());
}

#[test]
fn a_late_acknowledgement_is_not_a_fault_while_reports_arrive() {
    for dialect in Dialect::ALL {
        let delay = 2 * GRBL_SILENCE;
        let bench = bench(SimulatorConfig { spindle_delay: delay, ..SimulatorConfig::of(dialect) });
        let (mut stage, mut laser) = bench.open();
        let begun_at = crate::time::now();
        laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
        while crate::time::since(begun_at) < delay + SLACK {
            laser.renew(Duration::from_secs(1)).unwrap();
            laser.poll().unwrap();
            stage.poll().unwrap();
            crate::time::sleep(Duration::from_millis(20));
        }
        assert!(bench.light() && laser.poll().unwrap().emitting, "{dialect:?}: off");
    }
}

#[test]
fn a_refused_jog_is_the_stage_s_fault_and_not_the_laser_s() {
    let bench = bench(SimulatorConfig { axis: 'Y', ..SimulatorConfig::default() });
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    // The driver uses X, which this controller does not have; the answer may come during the call or after it.
    let refusal = stage.start_jog(1.0, 10.0).err().or_else(|| {
        wait_until(SLACK, "the refusal is reported", || stage.poll().is_err());
        stage.poll().err()
    });
    assert!(matches!(refusal, Some(StageError::Refused { .. })), "{refusal:?}");
    assert!(laser.poll().is_ok(), "the laser reports the stage's refusal");
    laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
    wait_until(SLACK, "it is on", || bench.light());
}

#[test]
fn a_door_that_brakes_moves_and_one_at_rest_holds() {
    for dialect in Dialect::ALL {
        let mut bench = bench(SimulatorConfig { acceleration_mm_s2: 40.0, ..SimulatorConfig::of(dialect) });
        bench.config = GrblConfig { travel_mm: (-40.0, 4.0), ..bench.config };
        let (mut stage, _laser) = bench.open();
        home(&mut stage);
        stage.start_move(-40.0, 20.0).unwrap();
        wait_until(Duration::from_secs(2), "it is fast", || stage.poll().unwrap().position_mm.unwrap() < -6.0);
        bench.simulator.receive(&[0x84]);
        wait_until(SLACK, "the door is reported", || !matches!(stage.poll().unwrap(), state if !state.moving));
        let event_log = bench.simulator.event_log();
        wait_until(Duration::from_secs(2), "it is held", || stage.poll().unwrap().held);
        assert!(!event_log.moving(), "{dialect:?}: held while it brakes");
        stage.stop().unwrap();
        assert!(rest(&mut stage).homed, "{dialect:?}: a stop at an open door lost the position");
    }
}

#[test]
fn a_failed_homing_is_an_alarm_that_can_be_cleared() {
    for dialect in Dialect::ALL {
        let bench = bench(SimulatorConfig { switch_works: false, ..SimulatorConfig::of(dialect) });
        let (mut stage, _laser) = bench.open();
        stage.start_home().unwrap();
        wait_until(Duration::from_secs(2), "it is reported", || stage.poll().is_err());
        let fault = stage.poll().unwrap_err();
        assert!(matches!(fault, StageError::Alarm { code: 9, .. }), "{dialect:?}: {fault}");
        stage.clear_fault().unwrap();
        wait_until(Duration::from_secs(2), "it is cleared", || stage.poll().is_ok());
        assert!(!stage.poll().unwrap().homed);
    }
}

#[test]
fn an_emergency_stop_stays_an_alarm_until_it_is_released() {
    let bench = bench(SimulatorConfig::of(Dialect::GrblHal));
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    bench.simulator.trigger_event(Event::EmergencyStop);
    bench.simulator.trigger_event(Event::Alarm(10));
    wait_until(SLACK, "it is reported", || stage.poll().is_err());
    let acknowledged_at = crate::time::now();
    while crate::time::since(acknowledged_at) < 2 * GRBL_SILENCE {
        assert!(matches!(stage.poll(), Err(StageError::Alarm { code: 10, .. })), "{:?}", stage.poll());
        crate::time::sleep(Duration::from_millis(20));
    }
    bench.simulator.repair();
    stage.clear_fault().unwrap();
    wait_until(Duration::from_secs(2), "it is cleared", || stage.poll().is_ok());
    home(&mut stage);
}

#[test]
fn the_laser_state_after_a_killed_host_is_reported_for_every_firmware() {
    let lost_host = |config: SimulatorConfig| bench(config).open().1.lost_host();
    for dialect in Dialect::ALL {
        assert!(lost_host(SimulatorConfig::of(dialect)).contains("no watchdog"), "{dialect:?}");
    }
    let sleeps = SimulatorConfig { sleeps: true, ..SimulatorConfig::of(Dialect::GrblHal) };
    assert!(lost_host(sleeps).contains("5 minutes"));
}
