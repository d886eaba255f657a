//! Every error is a problem with type, title, status and detail; what was wrong is named with its place.

use serde_json::Value;

use crate::common::server::Answer;
use crate::fresh;

#[track_caller]
fn is_problem(answer: &Answer, status: u16, kind: &str) -> Value {
    assert_eq!(answer.status, status, "{}", String::from_utf8_lossy(&answer.body));
    assert_eq!(answer.header("content-type"), Some("application/problem+json"));
    let problem = answer.json();
    assert_eq!(problem["type"], format!("urn:sheaf:problem:{kind}"));
    assert_eq!(problem["status"], status);
    problem
}

const JSON: [(&str, &str); 1] = [("content-type", "application/json")];

#[test]
fn whatever_cannot_be_understood_is_answered_with_a_problem() {
    let (_folder, server) = fresh();
    is_problem(&server.get("/api/v1/nothing"), 404, "not-found");
    is_problem(&server.get("/api/v1/scans/none"), 404, "not-found");
    let wrong_method = server.send("DELETE", "/api/v1/station", &[], &[]);
    is_problem(&wrong_method, 405, "method-not-allowed");
    assert!(wrong_method.header("allow").unwrap().contains("GET"), "{wrong_method:?}");
    let scans = |headers: &[(&str, &str)], body: &[u8]| server.send("POST", "/api/v1/scans", headers, body);
    is_problem(&scans(&[], b"{}"), 415, "unsupported-media-type");
    is_problem(&scans(&JSON, b"{\"source\":"), 400, "bad-request");
    is_problem(&scans(&JSON, &vec![b' '; 300 * 1024]), 413, "too-large");
    is_problem(&server.get("/api/v1/jobs?limit=0"), 400, "bad-request");
    is_problem(&server.get("/api/v1/jobs?colour=red"), 400, "bad-request");
}

#[test]
fn an_unknown_key_and_a_wrong_type_are_named_with_their_place() {
    let (_folder, server) = fresh();
    let scans = |body: &str| server.send("POST", "/api/v1/scans", &JSON, body.as_bytes());
    let unknown = is_problem(&scans(r#"{"source":{"kind":"station"},"stepp_mm":1}"#), 422, "impossible");
    assert_eq!(unknown["place"], "/stepp_mm");
    assert!(unknown["detail"].as_str().unwrap().contains("`stepp_mm`"), "{unknown}");
    let wrong = is_problem(&scans(r#"{"source":{"kind":"station"},"step_mm":"fine"}"#), 422, "impossible");
    assert_eq!(wrong["place"], "/step_mm");
    let inner = scans(r#"{"source":{"kind":"station","capture_id":"x"}}"#);
    assert!(is_problem(&inner, 422, "impossible")["detail"].as_str().unwrap().contains("`capture_id`"));
}

#[test]
fn a_scan_without_a_calibration_says_what_to_do() {
    let (_folder, server) = fresh();
    let answer = server.post("/api/v1/scans", &serde_json::json!({ "source": { "kind": "station" } }));
    let problem = is_problem(&answer, 409, "conflict");
    assert!(problem["remedy"].as_str().unwrap().contains("calibrat"), "{problem}");
}
