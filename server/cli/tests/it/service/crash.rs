//! Killed at random moments, the server keeps every record it acknowledged and comes back ready.
//!
//! What this does not show: a power cut, which loses what the operating system had not written; `store`'s tests hold
//! that files and folders are synced before the answer.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::common::controller::grbl_station;
use crate::common::server::{Server, zip_of};
use devices::grbl_simulator::{Entry, LogEvent};
use rand::{Rng as _, SeedableRng as _};
use serde_json::{Value, json};

/// Number of kills, and number in the campaign.
const KILLS: u64 = 8;
const KILLS_IN_CAMPAIGN: u64 = 30;

/// Promised time from start to readiness.
const READY_WITHIN: Duration = Duration::from_secs(5);

/// Maximum lifetime of one server, s: long enough for uploads, calibrations and scans to be in progress.
const LIFE_S: f64 = 4.0;

/// Minimum numbers of acknowledged captures, jobs, activations and results for a meaningful test.
const ENOUGH: [usize; 4] = [10, 10, 3, 3];

/// Maximum number of kills to reach them.
const KILLS_AT_MOST: u64 = 75;

/// Maximum number of queued or running jobs.
const WAITING: usize = 3;

/// Everything acknowledged with a 2xx response.
#[derive(Default)]
struct Acknowledged {
    captures: Vec<String>,
    jobs: Vec<String>,
    /// Jobs that may still change.
    followed: Vec<String>,
    /// Requested activations, and whether they were acknowledged.
    activations: Vec<(String, bool)>,
    results: Vec<(String, String)>,
}

#[test]
fn kills_lose_no_acknowledged_record_and_leave_no_partial_state() {
    kill_again_and_again(KILLS);
}

#[test]
#[ignore = "a minute and a half"]
fn campaign_of_thirty_kills() {
    kill_again_and_again(KILLS_IN_CAMPAIGN);
}

/// Kills the server `kills` times, and further until enough was acknowledged.
fn kill_again_and_again(kills: u64) {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let archive = Arc::new(zip_of(&crate::common::small_capture()));
    let known = Arc::new(Mutex::new(Acknowledged::default()));
    let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
    let mut counts = [0; 4];
    let enough = |counts: &[usize; 4]| counts.iter().zip(ENOUGH).all(|(&n, least)| n >= least);
    let mut n_kills = 0;
    // A busy computer does little in a lifetime: lifetimes grow until enough is acknowledged.
    while n_kills < kills || !enough(&counts) && n_kills < KILLS_AT_MOST {
        let kill = n_kills;
        n_kills += 1;
        let life_s = LIFE_S * (kill as f64 / kills as f64).max(1.0).powi(2);
        let begun = Instant::now();
        let server = Arc::new(Server::start(&data, &[]));
        assert_eq!(server.get("/ready").status, 200);
        let ready_after = begun.elapsed();
        assert!(ready_after <= READY_WITHIN, "ready after {ready_after:?} with kill {kill}");
        check(&server, &known.lock().unwrap());
        let ended = Arc::new(AtomicBool::new(false));
        let workers: Vec<_> = (0..3)
            .map(|worker| {
                let (server, archive, known, ended) =
                    (server.clone(), archive.clone(), known.clone(), ended.clone());
                std::thread::spawn(move || {
                    let mut step = kill + worker;
                    while !ended.load(Ordering::SeqCst) && act(&server, step, &archive, &known).is_some() {
                        step += 1;
                    }
                })
            })
            .collect();
        std::thread::sleep(Duration::from_secs_f64(life_s * rng.random::<f64>()));
        ended.store(true, Ordering::SeqCst);
        kill_9(server.pid());
        for worker in workers {
            worker.join().unwrap();
        }
        drop(server);
        let known = known.lock().unwrap();
        counts = [known.captures.len(), known.jobs.len(), known.activations.len(), known.results.len()];
    }
    let server = Server::start(&data, &[]);
    check(&server, &known.lock().unwrap());
    println!(
        "after {n_kills} kills: {counts:?} captures, jobs, activations, results acknowledged and found again"
    );
    assert!(enough(&counts), "too little happened to prove anything: {counts:?}");
}

/// Number of kills with laser and motion on.
const KILLS_IN_MOTION: usize = 5;

#[test]
fn after_a_kill_in_motion_laser_and_stage_are_off_and_nothing_restarts() {
    let folder = tempfile::tempdir().unwrap();
    let (simulator, config) = grbl_station(folder.path());
    let data = folder.path().join("data");
    let arguments = ["--config", config.to_str().unwrap()];
    let event_log = simulator.event_log();
    let mut lit = 0;
    for kill in 0..KILLS_IN_MOTION {
        let server = Server::start(&data, &arguments);
        let taken = server.post("/api/v1/station/control", &json!({ "holder": "test", "take_over": true }));
        let control = taken.json()["id"].as_str().unwrap().to_owned();
        let command = |method: &str, path: &str, body: Value| {
            let headers = [("content-type", "application/json"), ("sheaf-control", control.as_str())];
            let answer = server.send(method, path, &headers, body.to_string().as_bytes());
            assert!(answer.status < 300, "{path}: {}", String::from_utf8_lossy(&answer.body));
        };
        if kill % 2 == 0 {
            command("PUT", "/api/v1/station/live", json!({ "running": true, "laser_power": 0.5 }));
            wait_until("light", || event_log.light());
            lit += 1;
        } else {
            command("POST", "/api/v1/devices/stage/home", json!({}));
            wait_until("homing's end", || server.get("/api/v1/devices/stage").expect(200)["homed"] == true);
            command("POST", "/api/v1/devices/stage/move", json!({ "target_mm": -40, "speed_mm_s": 2 }));
            wait_until("motion", || event_log.moving());
        }
        server.kill();
        let server = Server::start(&data, &arguments);
        wait_until("laser off and at rest", || !event_log.light() && !event_log.moving());
        let mark = event_log.mark();
        assert_eq!(server.get("/ready").status, 200);
        // Long enough to detect an unwanted restart: the station polls the controller five times per second.
        std::thread::sleep(Duration::from_secs(1));
        let began = |entry: &Entry| matches!(entry.what, LogEvent::LightOn(_) | LogEvent::MotionBegan(_));
        assert!(!event_log.since(mark).iter().any(began), "{:?}", event_log.since(mark));
    }
    assert!((2..KILLS_IN_MOTION).contains(&lit));
}

#[track_caller]
fn wait_until(what: &str, mut reached: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !reached() {
        assert!(begun.elapsed() < Duration::from_secs(10), "no {what} within 10 s");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn kill_9(pid: u32) {
    let pid = nix::unistd::Pid::from_raw(i32::try_from(pid).unwrap());
    nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGKILL).unwrap();
}

/// Sends one request; `None` once the server is gone.
fn act(server: &Server, step: u64, archive: &[u8], known: &Mutex<Acknowledged>) -> Option<()> {
    match step % 5 {
        0 => {
            let headers = [("content-type", "application/zip")];
            let answer = server.try_send("POST", "/api/v1/captures", &headers, archive).ok()?;
            if answer.status == 201 {
                known.lock().unwrap().captures.push(answer.json()["id"].as_str()?.to_owned());
            }
        }
        1 => {
            let capture = known.lock().unwrap().captures.last().cloned();
            if let Some(capture_id) = capture {
                let source = json!({ "kind": "capture", "capture_id": capture_id });
                start_job(server, "/api/v1/calibrations", &json!({ "source": source }), known)?;
            }
        }
        2 => {
            let capture = known.lock().unwrap().captures.last().cloned();
            let active = known.lock().unwrap().activations.iter().any(|(_, acknowledged)| *acknowledged);
            if let (Some(capture_id), true) = (capture, active) {
                let source = json!({ "kind": "capture", "capture_id": capture_id, "scan": "gauge" });
                start_job(server, "/api/v1/scans", &json!({ "source": source }), known)?;
            }
        }
        3 => follow_jobs(server, known)?,
        _ => activate(server, known)?,
    }
    Some(())
}

fn start_job(server: &Server, path: &str, body: &Value, known: &Mutex<Acknowledged>) -> Option<()> {
    if known.lock().unwrap().followed.len() >= WAITING {
        return follow_jobs(server, known);
    }
    let headers = [("content-type", "application/json")];
    let answer = server.try_send("POST", path, &headers, body.to_string().as_bytes()).ok()?;
    match answer.status {
        202 => {
            let location = answer.header("location").unwrap().to_owned();
            let mut known = known.lock().unwrap();
            known.jobs.push(location.clone());
            known.followed.push(location);
        }
        status => assert!(status == 429, "{status}: {}", String::from_utf8_lossy(&answer.body)),
    }
    Some(())
}

/// Records the results of succeeded jobs.
fn follow_jobs(server: &Server, known: &Mutex<Acknowledged>) -> Option<()> {
    let followed = known.lock().unwrap().followed.clone();
    for location in followed {
        let job = server.try_send("GET", &location, &[], &[]).ok()?.json();
        if !matches!(job["state"].as_str(), Some("queued" | "running")) {
            known.lock().unwrap().followed.retain(|other| *other != location);
        }
        if job["state"] == "succeeded" {
            let part = |name: &str| job["result"][name].as_str().unwrap().to_owned();
            let made = (part("kind"), part("id"));
            let mut known = known.lock().unwrap();
            if !known.results.contains(&made) {
                known.results.push(made);
            }
        }
    }
    Some(())
}

fn activate(server: &Server, known: &Mutex<Acknowledged>) -> Option<()> {
    follow_jobs(server, known)?;
    let calibration = known.lock().unwrap().results.iter().rfind(|(kind, _)| kind == "calibration").cloned();
    let Some((_, id)) = calibration else { return Some(()) };
    let mut wanted = known.lock().unwrap();
    wanted.activations.push((id.clone(), false));
    let last = wanted.activations.len() - 1;
    drop(wanted);
    let body = json!({ "calibration_id": id }).to_string();
    let headers = [("content-type", "application/json")];
    let answer = server.try_send("PUT", "/api/v1/calibrations/active", &headers, body.as_bytes()).ok()?;
    assert_eq!(answer.status, 200, "{}", String::from_utf8_lossy(&answer.body));
    known.lock().unwrap().activations[last].1 = true;
    Some(())
}

/// Asserts that everything acknowledged exists and nothing is partial.
#[track_caller]
fn check(server: &Server, known: &Acknowledged) {
    for id in &known.captures {
        let capture = server.get(&format!("/api/v1/captures/{id}"));
        assert_eq!(capture.status, 200, "capture {id} is lost");
    }
    for job in &known.jobs {
        let job = server.get(job).expect(200);
        let state = job["state"].as_str().unwrap();
        assert!(
            ["queued", "running", "succeeded", "failed", "cancelled", "interrupted"].contains(&state),
            "{job:#}"
        );
        assert_ne!(state, "failed", "{job:#}");
        assert!(state != "succeeded" || job["result"]["href"].is_string(), "{job:#}");
    }
    for (kind, id) in &known.results {
        let href = format!("/api/v1/{kind}s/{id}");
        assert_eq!(server.get(&href).status, 200, "{href} is lost");
    }
    let active = server.get("/api/v1/calibrations/active");
    match known.activations.iter().rposition(|(_, acknowledged)| *acknowledged) {
        None => assert!(matches!(active.status, 200 | 404), "{}", active.status),
        Some(last) => {
            let id = active.expect(200)["calibration_id"].as_str().unwrap().to_owned();
            assert!(known.activations[last..].iter().any(|(wanted, _)| *wanted == id), "{id} was never wanted");
            let document = server.get(&format!("/api/v1/calibrations/{id}")).expect(200);
            assert_eq!(document["calibration"]["id"], id.as_str());
        }
    }
}
