//! Events: a stream that resumes where the client left off, without gaps or duplicates.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use serde_json::json;

use super::lists::damage;
use crate::common::server::Server;
use crate::http::fresh;

/// Causes one durable event.
#[track_caller]
fn take_over(server: &Server, holder: &str) {
    server.post("/api/v1/station/control", &json!({ "holder": holder, "take_over": true })).expect(201);
}

/// The ids of the next `n` durable events of a stream opened with `header`.
fn ids(server: &Server, header: &str, n: usize) -> Vec<u64> {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    let host = server.address();
    write!(stream, "GET /api/v1/events HTTP/1.1\r\nHost: {host}\r\nAccept: text/event-stream\r\n{header}\r\n\r\n")
        .unwrap();
    let lines = BufReader::new(stream).lines().map_while(Result::ok);
    lines.filter_map(|line| line.strip_prefix("id: ").and_then(|id| id.parse().ok())).take(n).collect()
}

#[test]
fn a_reconnecting_client_receives_missed_events_exactly_once() {
    let (_folder, server) = fresh();
    for holder in ["A", "B", "C", "D", "E"] {
        take_over(&server, holder);
    }
    let listed = server.get("/api/v1/events?limit=200").expect(200);
    let all: Vec<u64> = listed["items"].as_array().unwrap().iter().map(|e| e["seq"].as_u64().unwrap()).collect();
    assert!(all.len() >= 4, "{listed}");
    assert_eq!(ids(&server, "Last-Event-ID: 0", all.len()), all);
    let resumed = ids(&server, &format!("Last-Event-ID: {}", all[1]), all.len() - 2);
    assert_eq!(resumed, all[2..]);
    let next = server.get(listed["next"].as_str().unwrap()).expect(200);
    assert_eq!(next["items"].as_array().map(Vec::len), Some(0));
}

#[test]
fn an_open_stream_delivers_new_events() {
    let (_folder, server) = fresh();
    take_over(&server, "A");
    std::thread::scope(|scope| {
        let first = scope.spawn(|| ids(&server, "Last-Event-ID: 0", 3));
        for holder in ["B", "C", "D"] {
            take_over(&server, holder);
        }
        assert_eq!(first.join().unwrap().len(), 3);
    });
}

#[test]
fn a_damaged_event_is_reported_and_the_others_are_listed_and_streamed() {
    let folder = tempfile::TempDir::new().unwrap();
    let data = folder.path().join("data");
    let server = Server::start(&data, &[]);
    for holder in ["A", "B", "Tuesday", "D", "E"] {
        take_over(&server, holder);
    }
    let list = |server: &Server| server.get("/api/v1/events").expect(200);
    let seqs = |list: &serde_json::Value| -> Vec<u64> {
        list["items"].as_array().unwrap().iter().map(|event| event["seq"].as_u64().unwrap()).collect()
    };
    let before = list(&server);
    let to = |event: &&serde_json::Value| event["body"]["to"] == "Tuesday";
    let damaged = before["items"].as_array().unwrap().iter().find(to).unwrap()["seq"].as_u64().unwrap();
    server.terminate();
    // Opening merges the write-ahead log into the database.
    Server::start(&data, &[]).terminate();
    damage(&data, "\"to\":\"Tuesday\"");

    let server = Server::start(&data, &[]);
    let whole: Vec<u64> = seqs(&before).into_iter().filter(|seq| *seq != damaged).collect();
    let after = list(&server);
    assert_eq!(seqs(&after)[..whole.len()], whole);
    assert_eq!(after["damaged"][0]["id"], json!(damaged.to_string()), "{after}");
    assert_eq!(ids(&server, "Last-Event-ID: 0", whole.len()), whole);
}
