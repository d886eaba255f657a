//! Recordings of a live view and of a scan with the real binary: download, inspection, replay, deletion.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use recording::RecordingFile;
use serde_json::{Value, json};
use tempfile::TempDir;

use super::fresh;
use crate::common::server::Server;
use crate::common::{err, out, path, sheaf, sheaf_json, sheaf_ok, small_calibration, small_capture};

const PATIENCE: Duration = Duration::from_secs(60);

/// Takes control for the duration of the test.
fn controlled(server: &Server) -> String {
    let taken = server.post("/api/v1/station/control", &json!({ "holder": "Anna", "take_over": true }));
    taken.expect(201)["id"].as_str().unwrap().to_owned()
}

fn send(server: &Server, method: &str, path: &str, body: &Value) -> (u16, Value) {
    let control = controlled(server);
    let headers = [("content-type", "application/json"), ("sheaf-control", control.as_str())];
    let answer = server.send(method, path, &headers, body.to_string().as_bytes());
    (answer.status, if answer.body.is_empty() { Value::Null } else { answer.json() })
}

fn live(server: &Server, running: bool) {
    let body = json!({ "running": running, "laser_power": if running { 1.0 } else { 0.0 } });
    assert_eq!(send(server, "PUT", "/api/v1/station/live", &body).0, 200);
}

fn wait_for(server: &Server, href: &str, what: &str, seen: impl Fn(&Value) -> bool) -> Value {
    let begun = Instant::now();
    loop {
        let now = server.get(href).expect(200);
        if seen(&now) {
            return now;
        }
        assert!(begun.elapsed() < PATIENCE, "no {what}: {now:#}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The id of a recording of some frames of a live view.
pub fn recorded_live_view(server: &Server) -> Value {
    live(server, true);
    let (status, begun) = send(server, "POST", "/api/v1/recordings", &json!({}));
    assert_eq!(status, 201, "{begun:#}");
    let href = format!("/api/v1/recordings/{}", begun["id"].as_str().unwrap());
    wait_for(server, &href, "frames", |recording| recording["n_frames"].as_u64().unwrap() >= 1);
    assert_eq!(send(server, "POST", &format!("{href}/stop"), &json!({})).0, 200);
    live(server, false);
    begun["id"].clone()
}

/// Downloads the file of a recording.
fn fetched(server: &Server, recording: &Value, folder: &Path) -> PathBuf {
    let file = server.get(recording["file"].as_str().expect("a file"));
    assert_eq!(file.status, 200);
    let path = folder.join("fetched.mcap");
    std::fs::write(&path, file.body).unwrap();
    path
}

#[test]
fn a_live_view_is_recorded_fetched_in_ranges_and_deleted_with_its_bytes() {
    let (folder, server) = fresh();
    let (status, refused) = send(&server, "POST", "/api/v1/recordings", &json!({}));
    assert_eq!((status, &refused["type"]), (409, &json!("urn:sheaf:problem:conflict")), "{refused:#}");
    assert!(refused["remedy"].as_str().unwrap().contains("live view"), "{refused:#}");
    live(&server, true);
    let nobody = server.post("/api/v1/recordings", &json!({}));
    assert_eq!(nobody.expect(409)["type"], "urn:sheaf:problem:control-required");
    let (status, begun) = send(&server, "POST", "/api/v1/recordings", &json!({ "name": "morning" }));
    assert_eq!((status, &begun["state"], &begun["file"]), (201, &json!("recording"), &Value::Null), "{begun:#}");
    let href = format!("/api/v1/recordings/{}", begun["id"].as_str().unwrap());
    let (status, second) = send(&server, "POST", "/api/v1/recordings", &json!({}));
    assert_eq!(status, 409, "{second:#}");
    assert_eq!(send(&server, "DELETE", &href, &Value::Null).0, 409, "it runs");
    wait_for(&server, &href, "frames", |recording| recording["n_frames"].as_u64().unwrap() >= 5);
    let before_stop = server.get("/api/v1/station").expect(200)["frames"]["arrived"].as_u64().unwrap();
    let (status, ended) = send(&server, "POST", &format!("{href}/stop"), &json!({}));
    assert_eq!(
        (status, &ended["state"], &ended["ended"]),
        (200, &json!("complete"), &json!("stopped")),
        "{ended:#}"
    );
    assert_eq!(server.get(&href).expect(200), ended, "what was answered is what is kept");
    assert_eq!(server.get("/api/v1/recordings").expect(200)["items"], json!([ended]));
    live(&server, false);

    let file = fetched(&server, &ended, folder.path());
    let bytes = std::fs::read(&file).unwrap();
    assert_eq!(bytes.len() as u64, ended["size_bytes"].as_u64().unwrap());
    let recorded = RecordingFile::open(&file).unwrap();
    assert_eq!(recorded.frames.len() as u64, ended["n_frames"].as_u64().unwrap());
    assert_eq!((recorded.header.name.as_str(), recorded.is_complete), ("morning", true));
    assert!(recorded.frames.last().unwrap().note.sequence >= before_stop, "the newest frames are in it");
    // Every exposure is either recorded or lost.
    let mut next = recorded.frames[0].note.sequence;
    for frame in &recorded.frames {
        assert_eq!(
            frame.note.sequence,
            next + frame.note.lost_before.recorder,
            "a frame is missing and not counted"
        );
        next = frame.note.sequence + 1;
    }
    assert!(recorded.events.iter().any(|(_, event)| event.kind == "recording.started"), "{:?}", recorded.events);
    assert!(!recorded.settings.is_empty());

    let file_href = ended["file"].as_str().unwrap();
    let part = server.send("GET", file_href, &[("range", "bytes=8-27")], &[]);
    assert_eq!((part.status, &part.body[..]), (206, &bytes[8..28]));
    assert_eq!(part.header("content-range"), Some(format!("bytes 8-27/{}", bytes.len()).as_str()));
    let end = server.send("GET", file_href, &[("range", "bytes=-8")], &[]);
    assert_eq!(end.body, bytes[bytes.len() - 8..]);
    let beyond = server.send("GET", file_href, &[("range", "bytes=99999999999-")], &[]);
    assert_eq!(beyond.expect(416)["type"], "urn:sheaf:problem:range-not-satisfiable");

    let artifacts = folder.path().join("data/artifacts");
    let stored = || find(&artifacts, bytes.len() as u64);
    assert!(stored(), "the file is among the artifacts");
    assert_eq!(send(&server, "DELETE", &href, &Value::Null).0, 204);
    assert_eq!(server.get(&href).status, 404);
    let begun = Instant::now();
    while stored() {
        assert!(begun.elapsed() < PATIENCE, "its bytes are not freed");
        std::thread::sleep(Duration::from_millis(50));
    }
    let events = server.get("/api/v1/events?limit=200").expect(200);
    let kinds: Vec<&str> =
        events["items"].as_array().unwrap().iter().map(|e| e["kind"].as_str().unwrap()).collect();
    for kind in ["recording.started", "recording.ended", "recording.deleted"] {
        assert!(kinds.contains(&kind), "{kinds:?}");
    }
}

/// Whether `folder` contains a file of this size.
fn find(folder: &Path, size_bytes: u64) -> bool {
    std::fs::read_dir(folder).unwrap().flatten().any(|entry| {
        let path = entry.path();
        if path.is_dir() {
            find(&path, size_bytes)
        } else {
            entry.metadata().is_ok_and(|file| file.len() == size_bytes)
        }
    })
}

#[test]
fn a_recording_ends_with_its_live_view_and_with_the_service() {
    let (folder, server) = fresh();
    live(&server, true);
    let (_, begun) = send(&server, "POST", "/api/v1/recordings", &json!({}));
    let href = format!("/api/v1/recordings/{}", begun["id"].as_str().unwrap());
    wait_for(&server, &href, "frames", |recording| recording["n_frames"].as_u64().unwrap() >= 2);
    live(&server, false);
    let ended = wait_for(&server, &href, "end", |recording| recording["state"] == "complete");
    assert_eq!(ended["ended"], "live_ended");
    live(&server, true);
    let (_, begun) = send(&server, "POST", "/api/v1/recordings", &json!({}));
    let href = format!("/api/v1/recordings/{}", begun["id"].as_str().unwrap());
    wait_for(&server, &href, "frames", |recording| recording["n_frames"].as_u64().unwrap() >= 2);
    server.terminate();
    let server = Server::start(&folder.path().join("data"), &[]);
    let ended = server.get(&href).expect(200);
    // The last stop also ends the live view.
    assert_eq!(ended["state"], "complete", "{ended:#}");
    assert!(["live_ended", "service_ended"].contains(&ended["ended"].as_str().unwrap()), "{ended:#}");
}

/// A server with a station that replays a recording.
fn playing(file: &Path) -> (TempDir, Server) {
    let folder = TempDir::new().unwrap();
    let recording = format!("station.replay.recording={}", file.display());
    let mut arguments =
        vec!["--set".to_owned(), recording, "--set".to_owned(), "station.replay.frame_rate_hz=20".into()];
    for device in ["camera", "stage", "laser"] {
        arguments.extend(["--set".to_owned(), format!("station.{device}.kind=replay")]);
    }
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let server = Server::start(&folder.path().join("data"), &arguments);
    (folder, server)
}

fn calibrate(server: &Server) {
    let source = json!({ "kind": "capture", "capture_id": server.upload(&small_capture()) });
    let id = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
    server.put("/api/v1/calibrations/active", &json!({ "calibration_id": id })).expect(200);
}

fn cloud(server: &Server, scan_id: &str) -> Vec<u8> {
    let cloud = server.get(&format!("/api/v1/scans/{scan_id}/cloud?format=ply"));
    assert_eq!(cloud.status, 200);
    cloud.body
}

/// A recording of a scan of the gauge in the small capture, made by a station that replays the capture, with its cloud.
fn recorded_scan(mode: &str, folder: &Path) -> (PathBuf, Vec<u8>) {
    let kinds = "[station]\ncamera.kind = \"replay\"\nstage.kind = \"replay\"\nlaser.kind = \"replay\"\n";
    let file =
        format!("{kinds}[station.replay]\nfolder = {:?}\nscan = \"gauge\"\nframe_rate_hz = 20\n", small_capture());
    let data = folder.join(format!("data-{mode}"));
    std::fs::create_dir(&data).unwrap();
    std::fs::write(data.join("sheaf.toml"), file).unwrap();
    let server = Server::start(&data, &[]);
    calibrate(&server);
    let travel = server.get("/api/v1/devices/stage").expect(200)["travel_mm"].clone();
    let wish = json!({ "source": { "kind": "station" }, "name": "gauge", "mode": mode, "record": true,
        "from_mm": travel[0], "to_mm": travel[1] });
    let scan_id = server.result_of("/api/v1/scans", &wish);
    let scan = server.get(&format!("/api/v1/scans/{scan_id}")).expect(200);
    assert_eq!(scan["state"], "complete", "{scan:#}");
    let listed = server.get("/api/v1/recordings").expect(200)["items"][0].clone();
    assert_eq!((&listed["scan_id"], &listed["ended"]), (&json!(scan_id), &json!("scan_ended")), "{listed:#}");
    assert_eq!(listed["n_rows"], scan["report"]["n_frames"]);
    (fetched(&server, &listed, folder), cloud(&server, &scan_id))
}

#[test]
fn an_exported_and_a_replayed_recording_reproduce_the_cloud_bit_by_bit() {
    let folder = TempDir::new().unwrap();
    for mode in ["stop_and_go", "continuous"] {
        let (file, expected) = recorded_scan(mode, folder.path());
        assert!(expected.len() > 10_000, "{} bytes", expected.len());

        let capture = path(folder.path(), &format!("exported-{mode}"));
        let exported = sheaf(&["recording", "export", file.to_str().unwrap(), "-o", &capture]);
        assert_eq!(exported.status.code(), Some(0), "{}{}", out(&exported), err(&exported));
        let (calibration, ply) = (path(Path::new(&capture), "calibration.json"), path(folder.path(), "out.ply"));
        sheaf_ok(&["scan", &capture, "-c", &calibration, "--scan", "gauge", "-o", &ply, "-q"]);
        assert!(std::fs::read(&ply).unwrap() == expected, "{mode}: the cloud of the export differs");
        let stated: Value = serde_json::from_slice(&std::fs::read(calibration).unwrap()).unwrap();
        let own: Value = serde_json::from_slice(&std::fs::read(small_calibration()).unwrap()).unwrap();
        assert_eq!(stated["id"], own["id"]);

        let (_data, server) = playing(&file);
        let station = server.get("/api/v1/station").expect(200);
        assert_eq!((&station["simulated"], &station["faults"]), (&json!("replay"), &json!([])), "{station:#}");
        calibrate(&server);
        let travel = server.get("/api/v1/devices/stage").expect(200)["travel_mm"].clone();
        for played in ["stop_and_go", "continuous"] {
            let wish = json!({ "source": { "kind": "station" }, "name": "gauge", "mode": played,
                "from_mm": travel[0], "to_mm": travel[1] });
            let scan_id = server.result_of("/api/v1/scans", &wish);
            assert!(cloud(&server, &scan_id) == expected, "{mode} played {played}: the clouds differ");
        }
    }
}

#[test]
fn recordings_are_inspected_and_truncated_ones_repaired() {
    let folder = TempDir::new().unwrap();
    let (file, _) = recorded_scan("stop_and_go", folder.path());
    let (info, code) = sheaf_json(&["recording", "info", file.to_str().unwrap()]);
    assert_eq!((code, &info["lossy"], &info["is_complete"]), (0, &json!(false), &json!(true)), "{info:#}");
    assert_eq!(
        (&info["name"], &info["origin"], &info["simulated"]),
        (&json!("gauge"), &json!("scan"), &json!("replay"))
    );
    assert_eq!((&info["n_frames"], &info["size_px"]), (&info["n_rows"], &json!([640, 512])));
    assert_eq!(info["topics"]["/camera/image"], info["n_frames"]);
    let text = out(&sheaf_ok(&["recording", "info", file.to_str().unwrap()]));
    assert!(text.contains("lossy         no") && text.contains("/camera/image"), "{text}");

    // Truncated in the middle of a record.
    let bytes = std::fs::read(&file).unwrap();
    let broken = path(folder.path(), "broken.mcap");
    std::fs::write(&broken, &bytes[..bytes.len() / 2]).unwrap();
    let (info, code) = sheaf_json(&["recording", "info", &broken]);
    assert_eq!((code, &info["is_complete"], &info["ended"]), (7, &json!(false), &Value::Null), "{info:#}");
    let whole = path(folder.path(), "whole.mcap");
    let repaired = sheaf(&["recording", "repair", &broken, "-o", &whole]);
    assert_eq!(repaired.status.code(), Some(7), "{}", err(&repaired));
    assert!(out(&repaired).contains("skipped"), "{}", out(&repaired));
    let (again, _) = sheaf_json(&["recording", "info", &whole]);
    assert_eq!((&again["n_frames"], &again["is_complete"]), (&info["n_frames"], &json!(true)));
    let (twice, code) = sheaf_json(&["recording", "repair", &whole, "-o", &path(folder.path(), "twice.mcap")]);
    assert_eq!((code, &twice["was_complete"], &twice["lossy"]), (0, &json!(true), &json!(false)));
    let refused = sheaf(&["recording", "repair", &broken, "-o", &whole]);
    assert_eq!(refused.status.code(), Some(3), "an existing file is never written over");
    let no_file = sheaf(&["recording", "info", small_calibration().to_str().unwrap()]);
    assert_eq!(no_file.status.code(), Some(3));
    assert!(err(&no_file).contains("not an MCAP file"), "{}", err(&no_file));
}
