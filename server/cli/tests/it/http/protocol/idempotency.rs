//! One idempotency key is one request, even across a crash.

use serde_json::json;

use crate::common::server::{Server, zip_of};
use crate::common::small_capture;

#[test]
fn a_repeated_upload_creates_one_capture_even_after_a_crash() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let archive = zip_of(&small_capture());
    let headers = [("content-type", "application/zip"), ("idempotency-key", "upload-1")];
    let server = Server::start(&data, &[]);
    let first = server.send("POST", "/api/v1/captures", &headers, &archive);
    let made = first.expect(201);
    server.kill();
    let server = Server::start(&data, &[]);
    let again = server.send("POST", "/api/v1/captures", &headers, &archive);
    assert_eq!(again.expect(201), made);
    assert_eq!(again.header("location"), first.header("location"));
    assert_eq!(server.get("/api/v1/captures").expect(200)["items"].as_array().map(Vec::len), Some(1));
    let other = server.send("POST", "/api/v1/captures", &headers, &archive[..archive.len() / 2]);
    assert_eq!(other.expect(422)["type"], "urn:sheaf:problem:key-reused");
}

#[test]
fn a_repeated_request_creates_one_job() {
    let (_folder, server) = crate::http::fresh();
    let start = |body: serde_json::Value| {
        let headers = [("content-type", "application/json"), ("idempotency-key", "once")];
        server.send("POST", "/api/v1/calibrations", &headers, body.to_string().as_bytes())
    };
    let station = json!({ "source": { "kind": "station" } });
    let (first, second) = (start(station.clone()), start(station.clone()));
    assert_eq!(first.expect(202)["id"], second.expect(202)["id"]);
    let mut other = station;
    other["n_poses"] = json!(5);
    assert_eq!(start(other).expect(422)["type"], "urn:sheaf:problem:key-reused");
    assert_eq!(server.get("/api/v1/jobs").expect(200)["items"].as_array().map(Vec::len), Some(1));
    let cancel = format!("{}/cancel", first.header("location").unwrap());
    server.send("POST", &cancel, &[], &[]).expect(200);
    assert_eq!(server.wait_for_job(first.header("location").unwrap())["state"], "cancelled");
}

#[test]
fn the_query_is_part_of_the_request() {
    let (_folder, server) = crate::http::fresh();
    let archive = zip_of(&small_capture());
    let headers = [("content-type", "application/zip"), ("idempotency-key", "upload")];
    let upload = |name: &str| server.send("POST", &format!("/api/v1/captures?name={name}"), &headers, &archive);
    let made = upload("one").expect(201);
    assert_eq!(upload("one").expect(201), made);
    assert_eq!(upload("two").expect(422)["type"], "urn:sheaf:problem:key-reused");
}

#[test]
fn motions_and_images_with_a_key_happen_once_and_refused_requests_can_be_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let server = Server::start(&data, &[]);
    let session = server.post("/api/v1/calibration-sessions", &json!({})).expect(201);
    let path = format!("/api/v1/calibration-sessions/{}", session["id"].as_str().unwrap());
    let pose = |control: &str| {
        let headers = [("sheaf-control", control), ("idempotency-key", "pose-1")];
        server.send("POST", &format!("{path}/poses"), &headers, &[])
    };
    assert_eq!(pose("none").expect(409)["type"], "urn:sheaf:problem:control-required");
    let control =
        server.post("/api/v1/station/control", &json!({ "holder": "Anna", "take_over": true })).expect(201);
    let control = control["id"].as_str().unwrap();
    let first = pose(control);
    let taken = first.expect(200);
    assert_eq!(taken["body"]["poses"].as_array().map(Vec::len), Some(1));
    // The response is the same, whoever holds control now.
    let again = pose("none");
    assert_eq!((again.expect(200), again.header("etag")), (taken.clone(), first.header("etag")));
    assert_eq!(server.get(&path).expect(200), taken);

    let control =
        server.post("/api/v1/station/control", &json!({ "holder": "Anna", "take_over": true })).expect(201);
    let home = |server: &Server, control: &str| {
        let headers = [("sheaf-control", control), ("idempotency-key", "home-1")];
        server.send("POST", "/api/v1/devices/stage/home", &headers, &[])
    };
    let homed = home(&server, control["id"].as_str().unwrap()).expect(200);
    server.kill();
    let server = Server::start(&data, &[]);
    assert_eq!(home(&server, "none").expect(200), homed);
    assert_eq!(server.get("/api/v1/devices/stage").expect(200)["moving"], false);
}
