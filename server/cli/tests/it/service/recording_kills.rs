//! Killed at random moments while recording, the server leaves a readable file with everything up to the last second, and
//! repairs it at the next start.

use std::time::{Duration, Instant};

use rand::{Rng as _, SeedableRng as _};
use recording::RecordingFile;
use serde_json::{Value, json};

use crate::common::server::Server;

/// Number of kills in the regular test.
const KILLS: u64 = 3;

/// Number of kills in the campaign.
const MANY_KILLS: u64 = 100;

/// Maximum loss at the end.
const LAST: Duration = Duration::from_secs(1);

/// Maximum duration of a recording before the kill, s.
const LIFE_S: f64 = 2.0;

const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn a_recording_killed_at_random_loses_at_most_the_last_second() {
    kill_while_recording(KILLS);
}

#[test]
#[ignore = "a campaign of some minutes"]
fn campaign_of_a_hundred_kills_of_a_recording() {
    kill_while_recording(MANY_KILLS);
}

fn kill_while_recording(n_kills: u64) {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let (mut n_frames, mut interrupted) = (0, Vec::new());
    for kill in 0..n_kills {
        let server = Server::start(&data, &[]);
        check_repaired(&server, &mut interrupted);
        let lease =
            server.post("/api/v1/station/control", &json!({ "holder": "test", "take_over": true })).expect(201);
        let control = lease["id"].as_str().unwrap().to_owned();
        let command = |method: &str, path: &str, body: Value| {
            let headers = [("content-type", "application/json"), ("sheaf-control", control.as_str())];
            let answer = server.send(method, path, &headers, body.to_string().as_bytes());
            assert!(answer.status < 300, "{path}: {}", String::from_utf8_lossy(&answer.body));
            answer.json()
        };
        command("PUT", "/api/v1/station/live", json!({ "running": true, "laser_power": 0.5 }));
        let begun = command("POST", "/api/v1/recordings", json!({ "name": format!("kill {kill}") }));
        let id = begun["id"].as_str().unwrap().to_owned();
        std::thread::sleep(Duration::from_secs_f64(LIFE_S * rng.random::<f64>()));
        let arrived = server.get("/api/v1/station").expect(200)["frames"]["arrived"].as_u64().unwrap();
        let seen_at = Instant::now();
        std::thread::sleep(LAST);
        let pid = server.pid();
        server.kill();
        let file = RecordingFile::open(&data.join(format!("recordings/{id}.mcap"))).unwrap();
        let newest = file.frames.last().map_or(0, |frame| frame.note.sequence);
        assert!(
            file.frames.is_empty() && arrived == 0 || newest >= arrived,
            "kill {kill} (process {pid}): {arrived} frames had arrived {:?} before, the newest in the file is {newest}",
            seen_at.elapsed()
        );
        let mut next = file.frames.first().map_or(0, |frame| frame.note.sequence);
        for (idx, frame) in file.frames.iter().enumerate() {
            assert_eq!(
                frame.note.sequence,
                next + frame.note.lost_before.recorder,
                "a frame is missing, uncounted"
            );
            next = frame.note.sequence + 1;
            file.image(idx).unwrap();
        }
        n_frames += file.frames.len();
        interrupted.push((id, file.frames.len() as u64));
    }
    check_repaired(&Server::start(&data, &[]), &mut interrupted);
    println!("{n_frames} frames of {n_kills} recordings that were killed were read again");
    assert!(n_frames > 5 * n_kills as usize, "too little was recorded to prove anything: {n_frames} frames");
}

/// Asserts that interrupted recordings are stored with all their frames.
fn check_repaired(server: &Server, interrupted: &mut Vec<(String, u64)>) {
    for (id, n_frames) in interrupted.drain(..) {
        let href = format!("/api/v1/recordings/{id}");
        let begun = Instant::now();
        let recording = loop {
            let recording = server.get(&href).expect(200);
            if recording["state"] == "interrupted" {
                break recording;
            }
            assert!(begun.elapsed() < PATIENCE, "not repaired: {recording:#}");
            std::thread::sleep(Duration::from_millis(20));
        };
        assert_eq!((&recording["n_frames"], &recording["ended"]), (&json!(n_frames), &json!("crashed")));
        let file = server.get(recording["file"].as_str().unwrap());
        assert_eq!((file.status, &file.body[..8], &file.body[file.body.len() - 8..]), (200, MAGIC, MAGIC));
    }
}

/// How an MCAP file begins and ends.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";
