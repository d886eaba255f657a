//! A station over a recording: configured as any other, played live, scanned row by row; its cloud is that of
//! `sheaf scan` on the same capture, bit by bit.

use std::path::Path;

use serde_json::{Value, json};
use tempfile::TempDir;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;
use tokio_tungstenite::tungstenite::{Message, connect};

use crate::common::server::Server;
use crate::common::{err, path, sheaf, sheaf_ok, small_calibration, small_capture};

/// Offset of the number of points in the header of a profile.
const N_POINTS_AT: usize = 40;

/// All three devices are replayed.
const REPLAY: [&str; 6] = [
    "--set",
    "station.camera.kind=replay",
    "--set",
    "station.stage.kind=replay",
    "--set",
    "station.laser.kind=replay",
];

/// A station that replays the gauge of the small capture, configured partly in each layer.
fn replaying(capture: &Path) -> (TempDir, Server) {
    playing(capture, true)
}

/// The same, preloaded into memory or read from its files.
fn playing(capture: &Path, preload: bool) -> (TempDir, Server) {
    let folder = TempDir::new().unwrap();
    let data = folder.path().join("data");
    std::fs::create_dir(&data).unwrap();
    let kinds = "[station]\ncamera.kind = \"replay\"\nstage.kind = \"replay\"\nlaser.kind = \"replay\"\n";
    let file = format!("{kinds}[station.replay]\nfolder = {capture:?}\n");
    std::fs::write(data.join("sheaf.toml"), file).unwrap();
    let preload = preload.to_string();
    let environment =
        [("SHEAF_STATION__REPLAY__SCAN", "gauge"), ("SHEAF_STATION__REPLAY__PRELOAD", preload.as_str())];
    let server = Server::start_with(&data, &["--set", "station.replay.frame_rate_hz=20"], &environment);
    (folder, server)
}

/// Calibrates from an upload of the capture and activates the result.
fn calibrate(server: &Server, capture: &Path) -> String {
    let source = json!({ "kind": "capture", "capture_id": server.upload(capture) });
    let id = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
    server.put("/api/v1/calibrations/active", &json!({ "calibration_id": id })).expect(200);
    id
}

/// The next live profile with points: number of points and stage position.
fn next_profile(server: &Server) -> (u32, f64) {
    let mut request = format!("ws://{}/api/v1/stream", server.address()).into_client_request().unwrap();
    request.headers_mut().insert("Sec-WebSocket-Protocol", "sheaf.v1".parse().unwrap());
    let (mut socket, _) = connect(request).unwrap();
    let wish = json!({ "op": "subscribe", "streams": [{ "stream": "profile" }] });
    socket.send(Message::text(wish.to_string())).unwrap();
    loop {
        let Message::Binary(bytes) = socket.read().unwrap() else { continue };
        let n_points = u32::from_le_bytes(bytes[N_POINTS_AT..N_POINTS_AT + 4].try_into().unwrap());
        if n_points > 0 {
            return (n_points, f64::from_le_bytes(bytes[24..32].try_into().unwrap()));
        }
    }
}

/// Stage positions of the recorded gauge.
fn recorded_mm(capture: &Path) -> Vec<f64> {
    let manifest: Value = serde_json::from_slice(&std::fs::read(capture.join("capture.json")).unwrap()).unwrap();
    let scans = manifest["scans"].as_array().unwrap();
    let gauge = scans.iter().find(|scan| scan["name"] == "gauge").unwrap();
    gauge["frames"].as_array().unwrap().iter().map(|frame| frame["position_mm"].as_f64().unwrap()).collect()
}

#[test]
fn a_scan_of_a_replayed_capture_equals_that_of_the_capture_bit_by_bit() {
    let capture = small_capture();
    let positions_mm = recorded_mm(&capture);
    let (folder, server) = replaying(&capture);
    let station = server.get("/api/v1/station").expect(200);
    assert_eq!((&station["simulated"], &station["faults"]), (&json!("replay"), &json!([])));
    assert_eq!(station["camera"]["settings"]["frame_rate_hz"], 20.0);
    let snapshot = server.get("/api/v1/devices/camera/snapshot.jpg");
    assert_eq!((snapshot.status, &snapshot.body[..2]), (200, &[0xff, 0xd8][..]));
    let calibration_id = calibrate(&server, &capture);

    let control = server.post("/api/v1/station/control", &json!({ "holder": "Anna" })).expect(201);
    let headers = [("content-type", "application/json"), ("sheaf-control", control["id"].as_str().unwrap())];
    let live = |running: bool| {
        let body = json!({ "running": running, "laser_power": if running { 1.0 } else { 0.0 } }).to_string();
        server.send("PUT", "/api/v1/station/live", &headers, body.as_bytes()).expect(200);
    };
    live(true);
    let (n_points, at_mm) = next_profile(&server);
    assert!(n_points > 100 && positions_mm.contains(&at_mm), "{n_points} points at {at_mm} mm");
    live(false);

    let stage = server.get("/api/v1/devices/stage").expect(200);
    assert_eq!(stage["travel_mm"], json!([positions_mm[0], positions_mm[positions_mm.len() - 1]]));
    let wish = json!({
        "source": { "kind": "station" }, "name": "gauge",
        "from_mm": stage["travel_mm"][0], "to_mm": stage["travel_mm"][1],
    });
    let accepted = server.send("POST", "/api/v1/scans", &headers, wish.to_string().as_bytes());
    let job = accepted.expect(202);
    let made = server.wait_for_job(accepted.header("location").unwrap());
    assert_eq!(made["state"], "succeeded", "{job:#} {made:#}");
    let scan_id = made["result"]["id"].as_str().unwrap().to_owned();
    let scan = server.get(&format!("/api/v1/scans/{scan_id}")).expect(200);
    assert_eq!((&scan["state"], &scan["report"]["n_frames"]), (&json!("complete"), &json!(positions_mm.len())));
    let cloud = server.get(&format!("/api/v1/scans/{scan_id}/cloud?format=ply"));

    let (calibration, expected) = (small_calibration(), path(folder.path(), "expected.ply"));
    let stated: Value = serde_json::from_slice(&std::fs::read(&calibration).unwrap()).unwrap();
    assert_eq!(stated["id"], json!(calibration_id), "another calibration of the same capture");
    sheaf_ok(&[
        "scan",
        capture.to_str().unwrap(),
        "-c",
        calibration.to_str().unwrap(),
        "--scan",
        "gauge",
        "-o",
        &expected,
        "-q",
    ]);
    assert!(cloud.body == std::fs::read(expected).unwrap(), "the clouds differ");
}

#[test]
fn a_continuous_scan_over_a_replay_takes_every_frame_in_order_forwards_and_backwards() {
    let capture = small_capture();
    let positions_mm = recorded_mm(&capture);
    let (_folder, server) = playing(&capture, false);
    calibrate(&server, &capture);
    let (first_mm, last_mm) = (positions_mm[0], positions_mm[positions_mm.len() - 1]);
    let sweep = |from_mm: f64, to_mm: f64| {
        let wish = json!({
            "source": { "kind": "station" }, "name": "gauge",
            "from_mm": from_mm, "to_mm": to_mm, "mode": "continuous",
        });
        let id = server.result_of("/api/v1/scans", &wish);
        let scan = server.get(&format!("/api/v1/scans/{id}")).expect(200);
        assert_eq!((&scan["state"], &scan["report"]["losses"]), (&json!("complete"), &json!([])), "{scan:#}");
        assert_eq!(scan["report"]["n_frames"], positions_mm.len());
        server.get(&format!("/api/v1/scans/{id}/cloud?format=ply")).body
    };
    let there = sweep(first_mm, last_mm);
    sweep(last_mm, first_mm);
    // The same frames in the same order give the same cloud.
    let rows = json!({ "source": { "kind": "station" }, "name": "gauge", "from_mm": first_mm, "to_mm": last_mm });
    let id = server.result_of("/api/v1/scans", &rows);
    assert!(there == server.get(&format!("/api/v1/scans/{id}/cloud?format=ply")).body, "the clouds differ");
}

#[test]
fn actions_that_a_replay_does_not_support_are_refused_with_a_remedy() {
    let capture = small_capture();
    let (_folder, server) = replaying(&capture);
    calibrate(&server, &capture);
    let from_to = |more: Value| {
        let mut wish = json!({ "source": { "kind": "station" }, "from_mm": -2, "to_mm": 2 });
        wish.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        server.post("/api/v1/scans", &wish).expect(422)
    };
    let fine = from_to(json!({ "step_mm": 0.01 }));
    assert_eq!(fine["pointer"], "/step_mm", "{fine}");
    let sweep = from_to(json!({ "mode": "continuous", "step_mm": 0.3 }));
    assert_eq!(sweep["pointer"], "/step_mm", "{sweep}");
    assert!(sweep["remedy"].as_str().unwrap().contains("stop-and-go"), "{sweep}");
}

#[test]
fn a_replay_station_without_its_folder_reports_the_missing_folder() {
    let unset = sheaf(&[&["serve"], &REPLAY[..]].concat());
    assert_eq!(unset.status.code(), Some(3), "{}", err(&unset));
    assert!(err(&unset).contains("set station.replay.folder"), "{}", err(&unset));

    // A missing folder may be on a disk that is mounted later: the service starts and reports it.
    let folder = TempDir::new().unwrap();
    let set = format!("station.replay.folder={}", path(folder.path(), "nowhere"));
    let server = Server::start(&folder.path().join("data"), &[&REPLAY[..], &["--set", &set]].concat());
    let station = server.get("/api/v1/station").expect(200);
    let fault = &station["faults"][0];
    assert_eq!((&station["state"], &fault["device"]), (&json!("Preoperational"), &json!("camera")), "{station:#}");
    assert!(fault["detail"].as_str().unwrap().contains("nowhere"), "{fault}");
    assert!(fault["remedy"].as_str().unwrap().contains("correct station.replay.folder"), "{fault}");
}
