//! The control lease, versions of settings, Stop for every client.

use serde_json::json;

use super::fresh;
use crate::common::server::Server;

const SETTINGS: &str = "/api/v1/devices/camera/settings";

#[track_caller]
fn take_control(server: &Server) -> String {
    let lease = server.post("/api/v1/station/control", &json!({ "holder": "Anna" })).expect(201);
    lease["id"].as_str().unwrap().to_owned()
}

#[test]
fn commands_need_the_control_lease_and_taking_over_is_an_event() {
    let (_folder, server) = fresh();
    let home = |headers: &[(&str, &str)]| server.send("POST", "/api/v1/devices/stage/home", headers, &[]);
    assert_eq!(home(&[]).expect(409)["type"], "urn:sheaf:problem:control-required");
    let anna = take_control(&server);
    home(&[("sheaf-control", &anna)]).expect(200);
    let ben = json!({ "holder": "Ben" });
    let refused = server.post("/api/v1/station/control", &ben).expect(409);
    assert!(refused["detail"].as_str().unwrap().contains("Anna"), "{refused}");
    server.post("/api/v1/station/control", &json!({ "holder": "Ben", "take_over": true })).expect(201);
    home(&[("sheaf-control", &anna)]).expect(409);
    let events = server.get("/api/v1/events").expect(200);
    let event = events["items"].as_array().unwrap().iter().find(|event| event["kind"] == "control.taken_over");
    let body = json!({ "principal": "local", "actor": "Ben", "source": "127.0.0.1", "from": "Anna", "to": "Ben" });
    assert_eq!(event.unwrap()["body"], body);
    assert!(events["items"].as_array().unwrap().iter().any(|event| event["kind"] == "stage.homed"), "{events}");
}

#[test]
fn camera_settings_are_protected_against_lost_updates() {
    let (_folder, server) = fresh();
    let control = take_control(&server);
    let seen = server.get(SETTINGS);
    let version = seen.header("etag").unwrap().to_owned();
    let change = |headers: &[(&str, &str)], exposure_us: f64| {
        let mut all = vec![("content-type", "application/json"), ("sheaf-control", control.as_str())];
        all.extend(headers);
        server.send("PATCH", SETTINGS, &all, json!({ "exposure_us": exposure_us }).to_string().as_bytes())
    };
    change(&[], 1500.0).expect(428);
    let changed = change(&[("if-match", &version)], 1500.0);
    assert_eq!(changed.expect(200)["exposure_us"], 1500.0);
    assert_ne!(changed.header("etag"), Some(version.as_str()));
    change(&[("if-match", &version)], 1600.0).expect(412);
    assert_eq!(server.get(SETTINGS).expect(200)["exposure_us"], 1500.0);
}

#[test]
fn auto_exposure_makes_lines_bright_without_saturation() {
    let (_folder, server) = fresh();
    let control = take_control(&server);
    let headers = [("content-type", "application/json"), ("sheaf-control", control.as_str())];
    let find = || server.send("POST", "/api/v1/devices/camera/auto-exposure", &headers, &[]);
    let refused = find().expect(409);
    assert!(refused["remedy"].as_str().unwrap().contains("live view with the laser"), "{refused}");
    let live = json!({ "running": true, "laser_power": 1.0 }).to_string();
    server.send("PUT", "/api/v1/station/live", &headers, live.as_bytes()).expect(200);
    let mut found = Vec::new();
    for begun_at_us in [40.0, 20_000.0] {
        let version = server.get(SETTINGS).header("etag").unwrap().to_owned();
        let with_version = [headers[0], headers[1], ("if-match", version.as_str())];
        let wanted = json!({ "exposure_us": begun_at_us }).to_string();
        server.send("PATCH", SETTINGS, &with_version, wanted.as_bytes()).expect(200);
        found.push(find().expect(200)["exposure_us"].as_f64().unwrap());
    }
    assert!(found[0] > 40.0 && found[1] < 20_000.0, "{found:?} µs");
    assert!((0.2..5.0).contains(&(found[0] / found[1])), "{found:?} µs");
}

#[test]
fn stop_works_for_everyone_with_any_body_and_any_host() {
    let (_folder, server) = fresh();
    let strange: [&[(&str, &str)]; 4] = [
        &[],
        &[("host", "evil.example")],
        &[("origin", "http://evil.example")],
        &[("content-type", "application/json"), ("idempotency-key", "\u{e9}")],
    ];
    for headers in strange {
        let stopped = server.send("POST", "/api/v1/station/stop", headers, b"{{{").expect(200);
        assert_eq!((&stopped["acknowledged"], &stopped["state"]), (&json!(true), &json!("Halted")), "{headers:?}");
    }
    assert_eq!(server.get("/api/v1/station").expect(200)["state"], "Halted");
}

#[test]
fn a_signal_ends_the_live_view_and_the_process_in_order() {
    let (folder, server) = fresh();
    let control = take_control(&server);
    let body = json!({ "running": true, "laser_power": 1.0 }).to_string();
    let headers = [("content-type", "application/json"), ("sheaf-control", control.as_str())];
    server.send("PUT", "/api/v1/station/live", &headers, body.as_bytes()).expect(200);
    assert!(server.terminate().success());
    let log = std::fs::read_to_string(folder.path().join("data.log")).unwrap();
    let dark = log.find("the laser is turned off first").expect("the log has the laser");
    assert!(dark < log.find("ended").expect("the log has the end"), "{log}");
}

#[test]
fn the_scene_of_the_simulated_station_can_be_changed() {
    let (_folder, server) = fresh();
    assert_eq!(server.get("/api/v1/simulation/scene").expect(200)["scene"], "sphere");
    server.put("/api/v1/simulation/scene", &json!({ "scene": "gauge" })).expect(200);
    assert_eq!(server.get("/api/v1/simulation/scene").expect(200)["scene"], "gauge");
    server.put("/api/v1/simulation/scene", &json!({ "scene": "cathedral" })).expect(422);
    let unknown = server.put("/api/v1/simulation/faults", &json!({ "name": "rain" })).expect(422);
    assert!(unknown.to_string().contains("camera_unplugged"), "{unknown}");
}

#[test]
fn an_stl_part_is_placed_on_the_simulated_stage_and_a_damaged_file_is_refused() {
    let (_folder, server) = fresh();
    let headers = [("content-type", "model/stl")];
    let part = tetrahedron();
    let placed = server.send("PUT", "/api/v1/simulation/scene/part", &headers, &part).expect(200);
    assert_eq!(placed["scene"], "part");
    let refused = server.send("PUT", "/api/v1/simulation/scene/part", &headers, &part[..part.len() - 1]);
    assert_eq!(refused.expect(422)["type"], "urn:sheaf:problem:impossible");
    let untyped = server.send("PUT", "/api/v1/simulation/scene/part", &[("content-type", "text/plain")], &part);
    assert_eq!(untyped.status, 415);
    assert_eq!(server.get("/api/v1/simulation/scene").expect(200)["scene"], "part");
}

/// A binary STL of four triangles, 20 mm high.
fn tetrahedron() -> Vec<u8> {
    let corners: [[f32; 3]; 4] = [[0.0, 0.0, 20.0], [-15.0, -10.0, 0.0], [15.0, -10.0, 0.0], [0.0, 15.0, 0.0]];
    let mut bytes = vec![0; 80];
    bytes.extend(4_u32.to_le_bytes());
    for triangle in [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] {
        bytes.extend([0; 12]);
        for corner in triangle {
            bytes.extend(corners[corner].iter().flat_map(|value| value.to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn camera_settings_survive_a_restart_and_unset_ones_keep_their_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let server = Server::start(&data, &[]);
    for body in [json!({ "exposure_us": 1500.0 }), json!({ "gain_db": 2.0 })] {
        let (control, seen) = (take_control(&server), server.get(SETTINGS));
        let headers = [
            ("content-type", "application/json"),
            ("sheaf-control", control.as_str()),
            ("if-match", seen.header("etag").unwrap()),
        ];
        server.send("PATCH", SETTINGS, &headers, body.to_string().as_bytes()).expect(200);
        server.send("DELETE", "/api/v1/station/control", &headers[1..2], &[]).expect(204);
    }
    let set = server.get(SETTINGS).expect(200);
    assert_eq!((&set["exposure_us"], &set["gain_db"]), (&json!(1500.0), &json!(2.0)));
    server.kill();
    let server = Server::start(&data, &[]);
    assert_eq!(server.get(SETTINGS).expect(200), set);
}

#[test]
fn a_dark_frame_is_taken_with_the_lens_covered_kept_across_a_restart_and_removed() {
    const DARK: &str = "/api/v1/devices/camera/dark-frame";
    let (folder, server) = fresh();
    server.get(DARK).expect(404);
    let control = take_control(&server);
    let headers = [("content-type", "application/json"), ("sheaf-control", control.as_str())];
    let take =
        |server: &Server, headers: &[(&str, &str)]| server.send("POST", DARK, headers, b"{\"n_frames\": 8}");
    let lit = take(&server, &headers).expect(422);
    assert!(lit["remedy"].as_str().unwrap().contains("cover the lens"), "{lit}");
    assert_eq!(take(&server, &headers[..1]).expect(409)["type"], "urn:sheaf:problem:control-required");
    for (name, value) in [("sensor_defects", json!(6.0)), ("lens_covered", json!(null))] {
        server.put("/api/v1/simulation/faults", &json!({ "name": name, "value": value })).expect(200);
    }
    let taken = take(&server, &headers).expect(200);
    assert_eq!((&taken["used"], &taken["n_frames"]), (&json!("full"), &json!(8)));
    assert!(taken["n_hot_pixels"].as_u64().unwrap() > 100 && taken["pattern"].as_f64().unwrap() > 1.0, "{taken}");
    assert_eq!(server.get("/api/v1/devices/camera").expect(200)["dark_frame"], "full");
    assert!(server.terminate().success());

    let server = Server::start(&folder.path().join("data"), &[]);
    assert_eq!(server.get(DARK).expect(200)["hot_pixels"], taken["hot_pixels"]);
    let control = take_control(&server);
    server.send("DELETE", DARK, &[("sheaf-control", control.as_str())], &[]).expect(204);
    server.get(DARK).expect(404);
    assert_eq!(server.get("/api/v1/devices/camera").expect(200)["dark_frame"], "no_dark_frame");
}
