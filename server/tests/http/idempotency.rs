//! One key is one request, also across a crash.

use serde_json::json;

use crate::common::server::{Server, zip_of};
use crate::common::small_capture;

#[test]
fn a_repeated_upload_is_one_capture_also_after_a_crash() {
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
fn a_repeated_job_is_one_job() {
    let (_folder, server) = crate::fresh();
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
