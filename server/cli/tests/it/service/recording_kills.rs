//! Killed at random moments while it records, the server leaves a file that opens with everything up to the last second,
//! and makes a whole one of it at the next start.

use std::time::{Duration, Instant};

use rand::{Rng as _, SeedableRng as _};
use recording::RecordingFile;
use serde_json::{Value, json};

use crate::common::server::Server;

/// How often the server is killed with the other tests.
const KILLS: u64 = 3;

/// How often in the campaign.
const MANY_KILLS: u64 = 100;

/// What may be missing at the end.
const LAST: Duration = Duration::from_secs(1);

/// Longest time a recording is under way before the kill, s.
const LIFE_S: f64 = 2.0;

const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn killed_while_it_records_the_file_holds_all_but_the_last_second() {
    kill_while_recording(KILLS);
}

#[test]
#[ignore = "a campaign of some minutes"]
fn killed_a_hundred_times_while_it_records_the_file_holds_all_but_the_last_second() {
    kill_while_recording(MANY_KILLS);
}

fn kill_while_recording(n_kills: u64) {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let (mut n_frames, mut interrupted) = (0, Vec::new());
    for kill in 0..n_kills {
        let server = Server::start(&data, &[]);
        check_mended(&server, &mut interrupted);
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
    check_mended(&Server::start(&data, &[]), &mut interrupted);
    println!("{n_frames} frames of {n_kills} recordings that were killed were read again");
    assert!(n_frames > 5 * n_kills as usize, "too little was recorded to prove anything: {n_frames} frames");
}

/// The recordings that were killed become files of the store with the frames that were in them.
fn check_mended(server: &Server, interrupted: &mut Vec<(String, u64)>) {
    for (id, n_frames) in interrupted.drain(..) {
        let href = format!("/api/v1/recordings/{id}");
        let begun = Instant::now();
        let recording = loop {
            let recording = server.get(&href).expect(200);
            if recording["state"] == "interrupted" {
                break recording;
            }
            assert!(begun.elapsed() < PATIENCE, "not mended: {recording:#}");
            std::thread::sleep(Duration::from_millis(20));
        };
        assert_eq!((&recording["n_frames"], &recording["ended"]), (&json!(n_frames), &json!("crashed")));
        let file = server.get(recording["file"].as_str().unwrap());
        assert_eq!((file.status, &file.body[..8], &file.body[file.body.len() - 8..]), (200, MAGIC, MAGIC));
    }
}

/// How an MCAP file begins and ends.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";
