//! Stop under load: from the request to the byte at the controller, 200 times.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::common::controller::grbl_station;
use crate::common::server::Server;
use devices::grbl_simulator::{GrblSimulator, LogEvent};
use serde_json::{Value, json};

/// Number of Stop requests.
const STOPS: usize = 200;

/// Promised time from the request to the first byte at the controller: 99 of 100.
const P99: Duration = Duration::from_millis(50);

/// Promised longest time.
const LONGEST: Duration = Duration::from_millis(200);

/// The bytes that stop a stage: feed hold and soft reset.
const STOP_BYTES: [u8; 2] = [b'!', 0x18];

/// Number of clients that poll meanwhile.
const POLLERS: usize = 6;

#[test]
fn two_hundred_stops_under_load_reach_the_controller() {
    stop_200_times();
}

#[test]
#[ignore = "a measurement of times: alone on a quiet machine"]
fn two_hundred_stops_under_load_reach_the_controller_in_time() {
    let (p99, longest) = stop_200_times();
    assert!(p99 <= P99, "p99 {p99:?}");
    assert!(longest <= LONGEST, "longest {longest:?}");
}

/// Stops a station under load again and again; the 99th percentile and the longest time from request to byte.
fn stop_200_times() -> (Duration, Duration) {
    let folder = tempfile::tempdir().unwrap();
    let (simulator, config) = grbl_station(folder.path());
    let server = Arc::new(Server::start(&folder.path().join("data"), &["--config", config.to_str().unwrap()]));
    let load = Load::begin(&server);
    let mut delays = Vec::new();
    let mut busy = 0;
    for round in 0..STOPS {
        let commander = Commander::take(&server);
        let reset = commander.send("POST", "/api/v1/station/reset", &json!({}));
        assert!(reset.status < 300, "round {round}: {}", String::from_utf8_lossy(&reset.body));
        busy += usize::from(commander.begin_something(round));
        std::thread::sleep(Duration::from_millis(((round * 7) % 40) as u64));
        let event_log = simulator.event_log();
        let mark = event_log.mark();
        let asked_at = Instant::now();
        assert_eq!(server.post("/api/v1/station/stop", &json!({})).status, 200);
        delays.push(first_stop_byte(&simulator, mark) - asked_at);
        wait_for_rest(&simulator);
        let mark = event_log.mark();
        let lit = |entry: &devices::grbl_simulator::Entry| matches!(entry.what, LogEvent::LightOn(_));
        assert!(!event_log.since(mark).iter().any(lit), "light after Stop");
    }
    drop(load);
    delays.sort();
    let (p99, longest) = (delays[STOPS * 99 / 100 - 1], delays[STOPS - 1]);
    println!(
        "{STOPS} stops, {busy} of them while something ran: median {:?}, p99 {p99:?}, longest {longest:?}",
        delays[STOPS / 2]
    );
    assert!(busy * 2 >= STOPS, "only {busy} stops met a busy station");
    (p99, longest)
}

#[test]
fn on_sigterm_laser_and_stage_are_stopped_before_the_process_ends() {
    let folder = tempfile::tempdir().unwrap();
    let (simulator, config) = grbl_station(folder.path());
    let event_log = simulator.event_log();
    for round in 0..2 {
        let server = Server::start(&folder.path().join("data"), &["--config", config.to_str().unwrap()]);
        let commander = Commander::take(&server);
        // The laser is on in the first round; homing, then motion in the second.
        assert!(commander.begin_something(round), "round {round}");
        wait_for("light or motion", || event_log.light() || event_log.moving());
        let mark = event_log.mark();
        assert!(server.terminate().success());
        assert!(!event_log.light() && !event_log.moving(), "the server has ended, but laser or motion has not");
        let ended = |entry: &devices::grbl_simulator::Entry| {
            matches!(entry.what, LogEvent::LightOff | LogEvent::MotionEnded(_))
        };
        assert!(event_log.since(mark).iter().any(ended), "round {round}: {:?}", event_log.since(mark));
    }
}

#[track_caller]
fn first_stop_byte(simulator: &GrblSimulator, mark: usize) -> Instant {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(5) {
        let byte = STOP_BYTES.iter().filter_map(|&byte| simulator.event_log().byte_since(mark, byte)).min();
        if let Some(at) = byte {
            return at;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("no stop byte reached the controller");
}

#[track_caller]
fn wait_for_rest(simulator: &GrblSimulator) {
    wait_for("laser off and at rest", || !simulator.event_log().light() && !simulator.event_log().moving());
}

#[track_caller]
fn wait_for(what: &str, reached: impl Fn() -> bool) {
    let begun = Instant::now();
    while !reached() {
        assert!(begun.elapsed() < Duration::from_secs(10), "no {what} within 10 s");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A client with the control lease.
struct Commander<'s> {
    server: &'s Server,
    control: String,
}

impl<'s> Commander<'s> {
    fn take(server: &'s Server) -> Self {
        let taken = server.post("/api/v1/station/control", &json!({ "holder": "test", "take_over": true }));
        assert!(taken.status < 300, "{}", String::from_utf8_lossy(&taken.body));
        Self { server, control: taken.json()["id"].as_str().unwrap().to_owned() }
    }

    /// Starts homing, a long move, or the live view with the laser; returns whether it was accepted.
    fn begin_something(&self, round: usize) -> bool {
        let homed = self.server.get("/api/v1/devices/stage").expect(200)["homed"] == true;
        let (method, path, body) = match (round % 3, homed) {
            (0, _) => ("PUT", "/api/v1/station/live", json!({ "running": true, "laser_power": 0.5 })),
            (_, false) => ("POST", "/api/v1/devices/stage/home", json!({})),
            (_, true) => {
                let target_mm = if round.is_multiple_of(2) { -20 } else { 20 };
                ("POST", "/api/v1/devices/stage/move", json!({ "target_mm": target_mm, "speed_mm_s": 5 }))
            }
        };
        self.send(method, path, &body).status < 300
    }

    fn send(&self, method: &str, path: &str, body: &Value) -> crate::common::server::Answer {
        let headers = [("content-type", "application/json"), ("sheaf-control", self.control.as_str())];
        self.server.send(method, path, &headers, body.to_string().as_bytes())
    }
}

/// Clients that continuously request everything.
struct Load {
    ended: Arc<AtomicBool>,
    clients: Vec<std::thread::JoinHandle<()>>,
}

impl Load {
    fn begin(server: &Arc<Server>) -> Self {
        let ended = Arc::new(AtomicBool::new(false));
        let clients = (0..POLLERS)
            .map(|client| {
                let (server, ended) = (server.clone(), ended.clone());
                let path = ["/api/v1/station", "/api/v1/jobs", "/metrics"][client % 3];
                std::thread::spawn(move || {
                    while !ended.load(Ordering::SeqCst) {
                        assert_eq!(server.get(path).status, 200);
                        std::thread::sleep(Duration::from_millis(5));
                    }
                })
            })
            .collect();
        Self { ended, clients }
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::SeqCst);
        for client in self.clients.drain(..) {
            let _ = client.join();
        }
    }
}
