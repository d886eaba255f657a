//! Every error is a problem with type, title, status and detail, and with a pointer to the invalid value.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::Value;

use crate::common::server::{Answer, Server, zip_of};
use crate::common::{copy_of_small, edit_manifest, small_capture};
use crate::http::fresh;

/// More jobs than the queue accepts.
const MANY_JOBS: usize = 40;

/// Space for a catalogue with its reserve, but less than any job requires.
const SMALL_DISK_MIB: u32 = 64;

/// Slightly more than the space that uploads leave free.
const NEARLY_FULL_DISK_MIB: u32 = 300;

/// More than a disk of [`NEARLY_FULL_DISK_MIB`] has left for uploads.
const UPLOAD_MIB: usize = 80;

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
fn malformed_requests_are_answered_with_a_problem() {
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
fn unknown_keys_and_wrong_types_are_reported_with_their_pointer() {
    let (_folder, server) = fresh();
    let scans = |body: &str| server.send("POST", "/api/v1/scans", &JSON, body.as_bytes());
    let unknown = is_problem(&scans(r#"{"source":{"kind":"station"},"stepp_mm":1}"#), 422, "impossible");
    assert_eq!(unknown["pointer"], "/stepp_mm");
    assert!(unknown["detail"].as_str().unwrap().contains("`stepp_mm`"), "{unknown}");
    let wrong = is_problem(&scans(r#"{"source":{"kind":"station"},"step_mm":"fine"}"#), 422, "impossible");
    assert_eq!(wrong["pointer"], "/step_mm");
    let inner = scans(r#"{"source":{"kind":"station","capture_id":"x"}}"#);
    assert!(is_problem(&inner, 422, "impossible")["detail"].as_str().unwrap().contains("`capture_id`"));
}

#[test]
fn a_scan_without_a_calibration_is_refused_with_a_remedy() {
    let (_folder, server) = fresh();
    let answer = server.post("/api/v1/scans", &serde_json::json!({ "source": { "kind": "station" } }));
    let problem = is_problem(&answer, 409, "conflict");
    assert!(problem["remedy"].as_str().unwrap().contains("calibrat"), "{problem}");
}

#[test]
fn a_full_queue_refuses_with_a_retry_time_and_accepts_jobs_when_one_is_cancelled() {
    let (_folder, server) = fresh();
    let body = serde_json::json!({ "source": { "kind": "station" } });
    let mut waiting = Vec::new();
    let refused = loop {
        let answer = server.post("/api/v1/calibrations", &body);
        if answer.status != 202 || waiting.len() == MANY_JOBS {
            break answer;
        }
        waiting.push(answer.header("location").unwrap().to_owned());
    };
    let problem = is_problem(&refused, 429, "too-many");
    assert!(problem["detail"].as_str().unwrap().contains("32 jobs"), "{problem}");
    assert!(problem["remedy"].as_str().unwrap().contains("cancel"), "{problem}");
    let retry_after_s: u32 = refused.header("retry-after").unwrap().parse().unwrap();
    assert!(retry_after_s > 0);
    let cancelled = server.post(&format!("{}/cancel", waiting.last().unwrap()), &serde_json::json!({}));
    assert!(cancelled.status < 300, "{cancelled:?}");
    server.post("/api/v1/calibrations", &body).expect(202);
}

#[test]
fn on_a_full_disk_jobs_and_uploads_are_refused_and_reads_work() {
    let folder = tempfile::TempDir::new().unwrap();
    let Some(server) = Server::start_on_small_disk(&folder.path().join("data"), SMALL_DISK_MIB) else { return };
    let body = serde_json::json!({ "source": { "kind": "station" } });
    let problem = is_problem(&server.post("/api/v1/calibrations", &body), 507, "storage-full");
    assert!(problem["detail"].as_str().unwrap().contains("MiB are free"), "{problem}");
    assert!(problem["remedy"].as_str().unwrap().contains("delete"), "{problem}");

    server.get("/api/v1/jobs").expect(200);
}

#[test]
fn an_upload_that_exceeds_the_disk_space_is_refused_before_or_during_transfer() {
    let folder = tempfile::TempDir::new().unwrap();
    let Some(server) = Server::start_on_small_disk(&folder.path().join("data"), NEARLY_FULL_DISK_MIB) else {
        return;
    };
    let is_full = |problem: &Value| {
        assert!(problem["detail"].as_str().unwrap().contains("MiB are free"), "{problem}");
        assert!(problem["remedy"].as_str().unwrap().contains("delete"), "{problem}");
    };
    // With a stated length no byte is accepted.
    let host = server.address();
    let head = format!("POST /api/v1/captures HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/zip\r\n");
    let stated = answer_to(&server, |stream| {
        write!(stream, "{head}Content-Length: {}\r\nConnection: close\r\n\r\n", UPLOAD_MIB << 20)
    });
    is_full(&is_storage_full(&stated));
    // Without one, the received bytes are discarded, and the client receives the reason while it is still sending.
    let chunk = vec![0; 1 << 20];
    let unstated = answer_to(&server, |stream| {
        write!(stream, "{head}Transfer-Encoding: chunked\r\nConnection: close\r\n\r\n")?;
        for _ in 0..UPLOAD_MIB {
            write!(stream, "{:x}\r\n", chunk.len())?;
            stream.write_all(&chunk)?;
            stream.write_all(b"\r\n")?;
        }
        stream.write_all(b"0\r\n\r\n")
    });
    is_full(&is_storage_full(&unstated));

    assert_eq!(server.get("/api/v1/captures").expect(200)["items"], serde_json::json!([]));
    // Nothing was left behind: a small upload still fits.
    server.upload(&small_capture());
}

fn is_storage_full(answer: &str) -> Value {
    assert!(answer.starts_with("HTTP/1.1 507"), "{answer}");
    let problem: Value = serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap();
    assert_eq!(problem["type"], "urn:sheaf:problem:storage-full");
    problem
}

/// The response of the server to what `send` writes, until the connection is closed.
fn answer_to(server: &Server, send: impl Fn(&mut TcpStream) -> std::io::Result<()>) -> String {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    send(&mut stream).unwrap();
    let mut said = String::new();
    stream.read_to_string(&mut said).unwrap();
    said
}

#[test]
fn arrays_as_objects_and_control_characters_in_names_are_refused() {
    let (_folder, server) = fresh();
    let post = |path: &str, body: Value| server.post(path, &body);
    let array =
        is_problem(&post("/api/v1/station/control", serde_json::json!(["Anna", false])), 422, "impossible");
    assert!(array["detail"].as_str().unwrap().contains("expected an object"), "{array}");
    let scan = serde_json::json!({ "source": ["station"] });
    assert_eq!(is_problem(&post("/api/v1/scans", scan), 422, "impossible")["pointer"], "/source");
    for name in ["a\u{7}b", "two\nlines", "a\u{202e}b"] {
        let session = serde_json::json!({ "name": name });
        assert_eq!(
            is_problem(&post("/api/v1/calibration-sessions", session), 422, "impossible")["pointer"],
            "/name"
        );
        let holder = serde_json::json!({ "holder": name });
        is_problem(&post("/api/v1/station/control", holder), 422, "impossible");
    }
    let capture = copy_of_small();
    edit_manifest(capture.path(), |manifest| manifest["scans"][0]["name"] = "two\nlines".into());
    let zip = [("content-type", "application/zip")];
    let upload = server.send("POST", "/api/v1/captures", &zip, &zip_of(capture.path()));
    assert_eq!(is_problem(&upload, 422, "impossible")["pointer"], "scans[0].name");
}

#[test]
fn unknown_methods_do_not_add_metrics() {
    let (_folder, server) = fresh();
    for method in ["BREW", "WHEN", "PROPFIND"] {
        let host = server.address();
        answer_to(&server, |stream| {
            write!(stream, "{method} /health HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")
        });
    }
    let figures = String::from_utf8(server.get("/metrics").body).unwrap();
    assert!(figures.contains("method=\"other\""), "{figures}");
    assert!(!figures.contains("BREW") && !figures.contains("PROPFIND"), "{figures}");
}
