//! The driver over real firmware compiled for this computer, connected by a pseudo-terminal.
//!
//! `SHEAF_TEST_GRBLHAL` is the program of github.com/grblHAL/Simulator, `SHEAF_TEST_GRBL` that of
//! github.com/grbl/grbl-sim with gnea/grbl; neither is part of this project, and without them these tests are noted as
//! not run. If the program has a limit switch, homing finds its zero; otherwise homing fails, and the tests that need a
//! zero are left out, which is printed.
//!
//! ```sh
//! SHEAF_TEST_GRBLHAL=… cargo test -p sheaf-devices firmware::real_grbl_hal -- --nocapture
//! ```
//! Not covered: times of a real board. The simulated processors share the machine with the tests.

mod controller;
mod suite;

use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use controller::Controller;

use super::wait_until;
use crate::drivers::grbl::{GrblLaser, GrblStage, open, open_line};
use crate::lines::serial_line::{PortLine, SerialLine, SerialLineError, SerialWriter};
use crate::params::FOREIGN_WINDOW;
use crate::{Laser, Stage, StageError};

/// Longest homing and longest move of these tests.
const MOTION_LIMIT: Duration = Duration::from_secs(60);

/// Low, so that a simulated processor keeps up with its step pulses on a busy computer.
const STEPS_PER_MM: f64 = 50.0;

/// Measurements of each stop.
const N_STOPS: usize = 10;

/// Settings supported by both firmwares: a stage of 200 mm, 100 mm/s and 500 mm/s², a laser, homing.
const SETTINGS: [&str; 11] = [
    "$X",
    "$100=50",
    "$110=6000",
    "$120=500",
    "$130=200",
    "$30=1000",
    "$32=1",
    "$22=1",
    "$24=300",
    "$25=3000",
    "$27=1",
];

/// Only X is homed in grblHAL.
const GRBL_HAL_SETTINGS: [&str; 3] = ["$44=1", "$45=0", "$46=0"];

#[test]
fn real_grbl_hal() {
    let Some(controller) = Controller::start("SHEAF_TEST_GRBLHAL") else { return };
    controller.set(&SETTINGS);
    controller.set(&GRBL_HAL_SETTINGS);
    all(&controller);
}

#[test]
fn real_grbl() {
    let Some(controller) = Controller::start("SHEAF_TEST_GRBL") else { return };
    controller.set(&SETTINGS);
    all(&controller);
}

fn all(controller: &Controller) {
    let (mut stage, mut laser) = open(&controller.config()).unwrap();
    println!("{:?}; if killed: {}", stage.identity(), laser.lost_host());
    if !home(&mut stage) {
        println!("homing fails: this program has no limit switch; what needs a zero is left out");
        return;
    }
    moves_stop(&mut stage);
    jogs_stop(&mut stage);
    light_stops(&mut stage, &mut laser);
    alarms_are_recovered_from(controller, &mut stage);
    drop((stage, laser));
    a_killed_host_is_replaced_by_a_new_one(controller);
}

/// Homes it; returns whether it found its zero. A failed homing can be cleared.
fn home(stage: &mut GrblStage) -> bool {
    let begun_at = Instant::now();
    stage.start_home().unwrap();
    let mut reports = Vec::new();
    loop {
        match stage.poll() {
            Ok(state) if state.moving => {
                if reports.last() != Some(&state.measured_at) {
                    reports.push(state.measured_at);
                }
            }
            Ok(state) => {
                println!("homed after {:?}, with {} reports on the way", begun_at.elapsed(), reports.len());
                return state.homed;
            }
            Err(fault) => {
                println!("{fault}");
                stage.clear_fault().unwrap();
                wait_until(MOTION_LIMIT, "the failed homing is cleared", || stage.poll().is_ok());
                return false;
            }
        }
        assert!(begun_at.elapsed() < MOTION_LIMIT, "homing does not end");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn at_rest(stage: &mut GrblStage) -> f64 {
    wait_until(MOTION_LIMIT, "it rests", || !stage.poll().unwrap().moving);
    stage.poll().unwrap().position_mm.expect("the position is kept")
}

/// Waits until it is in motion.
fn under_way(stage: &mut GrblStage) {
    let from_mm = stage.poll().unwrap().position_mm.unwrap();
    wait_until(MOTION_LIMIT, "it is moving", || {
        (stage.poll().unwrap().position_mm.unwrap() - from_mm).abs() > 5.0
    });
}

fn print_times(what: &str, mut times: Vec<Duration>) {
    times.sort();
    println!("{what}: median {:?}, max {:?} of {}", times[times.len() / 2], times[times.len() - 1], times.len());
}

fn moves_stop(stage: &mut GrblStage) {
    let times = (0..N_STOPS).map(|_| {
        let target_mm = if at_rest(stage) > 0.0 { -40.0 } else { 40.0 };
        stage.start_move(target_mm, 40.0).unwrap();
        under_way(stage);
        let called_at = Instant::now();
        stage.stop().unwrap();
        let at_mm = at_rest(stage);
        assert!((at_mm - target_mm).abs() > 1.0, "it went on to {at_mm} mm");
        called_at.elapsed()
    });
    print_times("Stop of a move at 40 mm/s to rest, reported and ready", times.collect());
}

fn jogs_stop(stage: &mut GrblStage) {
    let times = (0..N_STOPS).map(|_| {
        let far_mm = if at_rest(stage) > 0.0 { -80.0 } else { 80.0 };
        let target_mm = stage.start_jog(far_mm, 20.0).unwrap().target_mm;
        under_way(stage);
        let called_at = Instant::now();
        stage.stop().unwrap();
        let at_mm = at_rest(stage);
        assert!((at_mm - target_mm).abs() > 1.0, "it went on to {at_mm} mm");
        called_at.elapsed()
    });
    print_times("Stop of a jog at 20 mm/s to rest, reported and ready", times.collect());
}

/// With the laser on a stop waits for rest for only 0.3 s, then the laser is turned off at the cost of the position: a
/// simulated processor that lags loses it occasionally.
fn light_stops(stage: &mut GrblStage, laser: &mut GrblLaser) {
    let mut n_lost = 0;
    let mut times = Vec::new();
    for _ in 0..N_STOPS {
        let target_mm = if at_rest(stage) > 0.0 { -40.0 } else { 40.0 };
        laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
        wait_until(MOTION_LIMIT, "it is on", || laser.poll().unwrap().emitting);
        stage.start_move(target_mm, 20.0).unwrap();
        let begun_at = Instant::now();
        while begun_at.elapsed() < Duration::from_millis(700) {
            laser.renew(Duration::from_secs(1)).unwrap();
            stage.poll().unwrap();
            std::thread::sleep(Duration::from_millis(10));
        }
        let called_at = Instant::now();
        stage.stop().unwrap();
        wait_until(MOTION_LIMIT, "it is reported off", || !laser.poll().unwrap().emitting);
        times.push(called_at.elapsed());
        wait_until(MOTION_LIMIT, "it rests", || !stage.poll().unwrap().moving);
        if !stage.poll().unwrap().homed {
            n_lost += 1;
            assert!(home(stage), "homed once, and not again");
        }
    }
    print_times("Stop of a move with light to off, reported", times);
    println!("of these, {n_lost} lost the position");
}

fn alarms_are_recovered_from(controller: &Controller, stage: &mut GrblStage) {
    // A reset in motion, bypassing the driver: ALARM:3.
    let target_mm = if at_rest(stage) > 0.0 { -40.0 } else { 40.0 };
    stage.start_move(target_mm, 20.0).unwrap();
    under_way(stage);
    controller.press(&[0x18]);
    recovers(stage, 3);
    assert!(home(stage), "homed once, and not again");
    // A target beyond the travel: ALARM:2, after which a reset during the pause is lost.
    // Three unsolicited answers would be taken for garbage.
    controller.press(b"$20=1\n");
    std::thread::sleep(FOREIGN_WINDOW);
    controller.press(b"G90G53G1X-900F600\n");
    recovers(stage, 2);
    controller.press(b"$20=0\n");
    std::thread::sleep(FOREIGN_WINDOW);
    assert!(home(stage), "homed once, and not again");
}

fn recovers(stage: &mut GrblStage, expected: u32) {
    let begun_at = Instant::now();
    wait_until(MOTION_LIMIT, "the alarm is reported", || stage.poll().is_err());
    let fault = stage.poll().unwrap_err();
    assert!(matches!(fault, StageError::Alarm { code, .. } if code == expected), "{fault}");
    let reported_after = begun_at.elapsed();
    stage.clear_fault().unwrap();
    wait_until(MOTION_LIMIT, "the alarm is cleared", || stage.poll().is_ok());
    wait_until(MOTION_LIMIT, "it rests", || !stage.poll().unwrap().moving);
    println!("ALARM:{expected}: reported after {reported_after:?}, cleared after {:?}", begun_at.elapsed());
}

/// A line whose owner is killed: from then on nothing is written.
struct KillableLine(PortLine, Arc<AtomicBool>);

impl SerialLine for KillableLine {
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
        struct Writer(Box<dyn SerialWriter>, Arc<AtomicBool>);
        impl SerialWriter for Writer {
            fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError> {
                if self.1.load(Ordering::SeqCst) { Ok(()) } else { self.0.write_now(bytes) }
            }
        }
        Ok(Box::new(Writer(self.0.writer()?, Arc::clone(&self.1))))
    }
}

fn a_killed_host_is_replaced_by_a_new_one(controller: &Controller) {
    let config = controller.config();
    let killed = Arc::new(AtomicBool::new(false));
    let line = KillableLine(PortLine::new(&config.port, config.baud_rate), Arc::clone(&killed));
    let (mut stage, mut laser) = open_line(&config, Box::new(line)).unwrap();
    assert!(home(&mut stage));
    laser.switch_on(0.5, Duration::from_secs(1)).unwrap();
    stage.start_move(-40.0, 20.0).unwrap();
    std::thread::sleep(Duration::from_millis(500));
    killed.store(true, Ordering::SeqCst);
    drop((stage, laser));
    // No byte was sent; the controller's behaviour is now its own. A second later it is queried, bypassing the driver.
    std::thread::sleep(Duration::from_secs(1));
    let mut line = controller.line();
    line.write_all(b"?").unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let mut said = [0; 4096];
    let n = line.read(&mut said).unwrap();
    let said = String::from_utf8_lossy(&said[..n]).into_owned();
    let last = said.lines().rfind(|line| line.starts_with('<')).unwrap_or("nothing").to_owned();
    println!("a second after its host was killed it reports {last}");
    drop(line);
    let begun_at = Instant::now();
    let (mut stage, mut laser) = open(&config).unwrap();
    println!("opened again, off and at rest, after {:?}", begun_at.elapsed());
    assert!(!laser.poll().unwrap().emitting && !stage.poll().unwrap().homed);
    assert!(home(&mut stage));
}
