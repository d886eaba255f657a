//! The path of a stop from the call to the controller, under concurrent load.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::{SLACK, bench_in_real_time, default_bench, home, rest, wait_until};
use crate::drivers::grbl::open_line;
use crate::drivers::grbl::protocol::{HOLD, RESET};
use crate::lines::serial_line::{PortLine, SerialLine, SerialLineError, SerialWriter};
use crate::params::GRBL_SILENCE;
use crate::simulators::grbl_simulator::SimulatorConfig;
use crate::{Laser, Stage};

/// `promises.md` 4, from request to byte; the driver alone must meet it, too.
const P99_LIMIT: Duration = Duration::from_millis(50);
/// The same for the maximum.
const MAX_LIMIT: Duration = Duration::from_millis(200);
/// Sample size of the promise.
const N_STOPS: usize = 200;

/// Delay injected between a stop's byte and its message to the session.
const STOP_DELAY: Duration = Duration::from_millis(60);

/// A line in which the thread of a stop is delayed right after its byte was sent.
struct Interrupted(PortLine);

impl SerialLine for Interrupted {
    fn port_name(&self) -> String {
        self.0.port_name()
    }

    fn reopen(&mut self) -> Result<(), SerialLineError> {
        self.0.reopen()
    }

    fn close(&mut self) {
        self.0.close();
    }

    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError> {
        self.0.read(buffer, wait)
    }

    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError> {
        struct Writer(Box<dyn SerialWriter>);
        impl SerialWriter for Writer {
            fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError> {
                self.0.write_now(bytes)?;
                if matches!(bytes, [HOLD, ..] | [RESET]) {
                    crate::time::sleep(STOP_DELAY);
                }
                Ok(())
            }
        }
        Ok(Box::new(Writer(self.0.writer()?)))
    }
}

#[test]
fn an_answer_received_before_its_stop_is_recorded_is_assigned_to_it() {
    let bench = bench_in_real_time(SimulatorConfig::default());
    let line = Interrupted(PortLine::new(&bench.config.port, bench.config.baud_rate));
    let (mut stage, _laser) = open_line(&bench.config, Box::new(line)).unwrap();
    home(&mut stage);
    stage.start_move(4.0, 20.0).unwrap();
    // The reset that follows the first stop is answered before the call returns.
    for _ in 0..3 {
        stage.stop().unwrap();
    }
    let stopped_at = crate::time::now();
    // Longer than the answer's timeout: a reset still pending would be reported as missing by then.
    wait_until(Duration::from_secs(5), "time for an answer to be missed", || {
        stage.poll().unwrap();
        crate::time::since(stopped_at) > GRBL_SILENCE + SLACK
    });
    let state = rest(&mut stage);
    assert!(
        state.homed && state.position_mm.is_some(),
        "the stop's own answer was taken for something else: {state:?}"
    );
}

/// Every stop arrives under any load; the latency is tested below.
#[test]
fn two_hundred_stops_under_load_all_reach_the_controller() {
    stop_latencies();
}

#[test]
#[ignore = "measures milliseconds: run without other tests on an idle machine"]
fn two_hundred_stops_under_load_are_sent_within_the_limits() {
    let mut latencies = stop_latencies();
    latencies.sort();
    let (p50, p99, max) = (latencies[N_STOPS / 2], latencies[N_STOPS * 99 / 100], latencies[N_STOPS - 1]);
    println!("{N_STOPS} stops: p50 {p50:?}, p99 {p99:?}, max {max:?}");
    assert!(p99 <= P99_LIMIT && max <= MAX_LIMIT, "p99 {p99:?}, max {max:?}");
}

/// From the call of each stop to its byte in the event log, with commands and polls in flight all the time.
fn stop_latencies() -> Vec<Duration> {
    let bench = bench_in_real_time(SimulatorConfig::default());
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    let ended = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // Over the same line and lock.
        scope.spawn(|| {
            while !ended.load(Ordering::Relaxed) {
                laser.poll().ok();
                laser.switch_off().ok();
                crate::time::sleep(Duration::from_micros(200));
            }
        });
        let _end = EndOnDrop(&ended);
        (0..N_STOPS).map(|idx| stop_latency(&bench, &mut stage, idx)).collect()
    })
}

/// Ends the other thread, also when this one panics.
struct EndOnDrop<'a>(&'a AtomicBool);

impl Drop for EndOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// From the call of `stop` to its byte in the event log, in the middle of a move.
fn stop_latency(bench: &super::Bench, stage: &mut crate::drivers::grbl::GrblStage, idx: usize) -> Duration {
    let at_mm = rest(stage).position_mm.unwrap_or_else(|| panic!("stop {idx} lost the position"));
    let target_mm = if at_mm > 0.0 { -4.0 } else { 4.0 };
    stage.start_move(target_mm, 20.0).unwrap();
    // At different times of the move, independent of a clock: 0 to 9 polls later.
    for _ in 0..idx % 10 {
        stage.poll().unwrap();
        crate::time::sleep(Duration::from_millis(1));
    }
    let event_log = bench.simulator.event_log();
    let mark = event_log.mark();
    let called_at = crate::time::now();
    stage.stop().unwrap();
    let byte = || event_log.byte_since(mark, HOLD).or_else(|| event_log.byte_since(mark, RESET));
    super::wait_until(Duration::from_secs(1), "the stop's byte", || byte().is_some());
    byte().unwrap().saturating_duration_since(called_at)
}

#[test]
fn a_stop_keeps_the_position_and_turns_the_laser_off() {
    let bench = default_bench();
    let (mut stage, mut laser) = bench.open();
    home(&mut stage);
    laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
    stage.start_move(4.0, 20.0).unwrap();
    super::wait_until(Duration::from_secs(1), "it moves", || bench.simulator.event_log().moving());
    stage.stop().unwrap();
    super::wait_until(super::SLACK + Duration::from_millis(500), "laser off", || !bench.light());
    let state = rest(&mut stage);
    assert!(state.homed && state.position_mm.is_some(), "a stop lost the position: {state:?}");
    assert!(!laser.poll().unwrap().emitting, "stopped, and the laser is commanded on");
}

#[test]
fn repeated_stops_leave_the_controller_ready() {
    let bench = default_bench();
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    for _ in 0..20 {
        stage.stop().unwrap();
    }
    rest(&mut stage);
    stage.start_move(1.0, 20.0).unwrap();
    let at_mm = rest(&mut stage).position_mm.unwrap();
    assert!((at_mm - 1.0).abs() < 0.01, "at {at_mm} mm after many stops and a move to 1 mm");
}

#[test]
fn a_hold_sent_after_a_reset_does_not_persist() {
    let bench = default_bench();
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    // Some of these hit the moment between a reset and its banner.
    for idx in 0..60 {
        stage.stop().unwrap();
        crate::time::sleep(Duration::from_micros(500 * (idx % 20)));
        stage.stop().unwrap();
        rest(&mut stage);
        let state = stage.poll().unwrap();
        assert!(!state.held, "stop {idx} left it held");
        stage.start_move(if idx % 2 == 0 { 0.5 } else { 0.0 }, 50.0).unwrap();
        rest(&mut stage);
    }
}
