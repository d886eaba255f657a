//! FluidNC over TCP: its telnet port, simulated on the loopback address by a bridge to the simulated firmware's
//! terminal.

use parking_lot::Mutex;
use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use super::{Bench, bench_in_real_time, home, rest, wait_until};
use crate::contract::{self, LaserProfile, StageProfile};
use crate::simulators::grbl_simulator::{Dialect, SimulatorConfig};
use crate::{Stage, StageError};

/// Requests an option, as a telnet server may: DO SUPPRESS-GO-AHEAD.
const NEGOTIATION: [u8; 3] = [0xff, 0xfd, 0x03];

/// Passes bytes between a client and the terminal at the bench's path, one connection at a time.
struct Bridge {
    port: u16,
    connection: Arc<Mutex<Option<TcpStream>>>,
}

impl Bridge {
    fn to(bench: &Bench) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let connection: Arc<Mutex<Option<TcpStream>>> = Arc::default();
        let mut terminal = OpenOptions::new().read(true).write(true).open(bench.simulator.port_name()).unwrap();
        let (mut from, current) = (terminal.try_clone().unwrap(), Arc::clone(&connection));
        std::thread::spawn(move || {
            let mut buffer = [0; 256];
            while let Ok(n @ 1..) = from.read(&mut buffer) {
                if let Some(stream) = current.lock().as_mut() {
                    stream.write_all(&buffer[..n]).ok();
                }
            }
        });
        let current = Arc::clone(&connection);
        std::thread::spawn(move || {
            for mut stream in listener.incoming().flatten() {
                stream.write_all(&NEGOTIATION).ok();
                *current.lock() = stream.try_clone().ok();
                let mut buffer = [0; 256];
                while let Ok(n @ 1..) = stream.read(&mut buffer) {
                    terminal.write_all(&buffer[..n]).ok();
                }
            }
        });
        Self { port, connection }
    }

    fn cut(&self) {
        if let Some(stream) = self.connection.lock().take() {
            stream.shutdown(Shutdown::Both).ok();
        }
    }
}

fn bench_over_tcp() -> (Bench, Bridge) {
    let mut bench = bench_in_real_time(SimulatorConfig::of(Dialect::FluidNc));
    let bridge = Bridge::to(&bench);
    bench.config.port = format!("tcp://127.0.0.1:{}", bridge.port);
    (bench, bridge)
}

#[test]
fn a_stage_over_tcp_passes_the_suite_but_for_its_cable() {
    let (bench, _bridge) = bench_over_tcp();
    let profile = StageProfile {
        speed_mm_s: 20.0,
        tolerance_mm: 0.5 / super::STEPS_PER_MM + 0.001,
        instant: false,
        motion_limit: Duration::from_secs(2),
        rest_limit: Duration::from_millis(800),
        reset_button: None,
        cable: None,
    };
    contract::stage(&mut || Box::new(bench.open().0), &profile);
}

#[test]
fn a_laser_over_tcp_passes_the_suite_but_for_its_cable() {
    let (bench, _bridge) = bench_over_tcp();
    let event_log = bench.simulator.event_log().clone();
    let profile = LaserProfile {
        light: Some(Box::new(move || event_log.light())),
        reaction_limit: Duration::from_millis(500),
        cable: None,
    };
    contract::laser(&mut || Box::new(bench.open().1), &profile);
}

#[test]
fn a_lost_connection_is_reported_within_a_second_and_returns_unhomed() {
    let (bench, bridge) = bench_over_tcp();
    let (mut stage, _laser) = bench.open();
    home(&mut stage);
    stage.start_move(-4.0, 100.0).unwrap();
    rest(&mut stage);
    stage.start_move(4.0, 4.0).unwrap();
    bridge.cut();
    wait_until(Duration::from_secs(1), "it is noticed", || stage.poll().is_err());
    assert!(matches!(stage.poll(), Err(StageError::Disconnected { .. })), "{:?}", stage.poll());
    stage.reconnect().unwrap();
    wait_until(Duration::from_secs(5), "it is reconnected", || stage.poll().is_ok());
    let state = stage.poll().unwrap();
    assert!(!state.homed && state.position_mm.is_none(), "{state:?}");
    wait_until(Duration::from_secs(1), "it rests", || !bench.simulator.event_log().moving());
}
