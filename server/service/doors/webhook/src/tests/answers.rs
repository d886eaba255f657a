//! What receivers answer, if they do.

use std::net::TcpListener;
use std::sync::mpsc::channel;
use std::time::Duration;

use app::doors::Undelivered;
use ureq::tls::RootCerts;

use super::receiver::{Receiver, answer_with, write};
use super::{deliver, door, open, settings, unreachable};
use crate::resolver::system_lookup;

/// More than the kernel buffers between two ends of a connection, far less than a second carries.
const BUFFERED_BYTES: usize = 32 * 1024 * 1024;

async fn answered(head: &str, body: &str) -> Result<(), Undelivered> {
    let receiver = Receiver::start(answer_with(head, body));
    let outcome = deliver(&door(&format!("http://{}/", receiver.address))).await;
    assert_eq!(receiver.requests().len(), 1);
    outcome
}

#[tokio::test]
async fn an_answer_decides_what_becomes_of_the_event() {
    let refused = |reason: &str| Err(Undelivered::Refused(format!("the receiver answered {reason}")));
    let later = |reason: &str, after_s: Option<u64>| {
        let reason = format!("the receiver answered {reason}");
        Err(Undelivered::Unreachable { reason, retry_after: after_s.map(Duration::from_secs) })
    };
    assert_eq!(answered("200 OK", "thanks").await, Ok(()));
    assert_eq!(answered("299 Fine", "").await, Ok(()));
    assert_eq!(answered("422 Unprocessable", "no\r\npart").await, refused("422 Unprocessable Entity: no part"));
    assert_eq!(answered("500 Oops", "").await, refused("500 Internal Server Error"));
    assert_eq!(answered("304 Same", "").await, refused("304 Not Modified"));
    assert_eq!(answered("503 Busy", "").await, later("503 Service Unavailable", None));
    assert_eq!(answered("429 Slow\r\nRetry-After: 90", "").await, later("429 Too Many Requests", Some(90)));
    let gone = Undelivered::Closed("the receiver answered 410 Gone: bye".to_owned());
    assert_eq!(answered("410 Gone", "bye").await, Err(gone));
}

#[tokio::test]
async fn a_redirect_is_not_followed() {
    let elsewhere = Receiver::start(answer_with("204 No Content", ""));
    for status in [301, 302, 303, 307, 308] {
        let location = format!("http://{}/", elsewhere.address);
        let outcome = answered(&format!("{status} Moved\r\nlocation: {location}"), "moved").await;
        let Err(Undelivered::Refused(reason)) = outcome else { panic!("{status}: {outcome:?}") };
        assert!(reason.ends_with(&format!("redirects are not followed; it refers to {location}")), "{reason}");
    }
    assert_eq!(elsewhere.n_connections(), 0);
}

#[tokio::test]
async fn a_receiver_that_is_slow_to_answer_is_given_up() {
    // Each waits until the test ends.
    let (end, ended) = channel::<()>();
    let silent = Receiver::start(move |_| ended.recv().unwrap_or_default());
    let slow = Receiver::start(move |to| {
        while to.write_all(b"HTTP/1.1 200 OK\r\nx: ").and_then(|()| to.flush()).is_ok() {
            std::thread::sleep(Duration::from_millis(100));
        }
    });
    for address in [silent.address, slow.address] {
        let impatient = settings(&format!("http://{address}/"), &["127.0.0.1"]);
        let door = open(impatient, system_lookup, RootCerts::WebPki);
        assert_eq!(unreachable(&door).await, "127.0.0.1 did not answer within 1 s");
    }
    drop(end);
}

#[tokio::test]
async fn a_receiver_that_does_not_speak_is_waited_for() {
    let closing = Receiver::start(|_| ());
    let reason = unreachable(&door(&format!("http://{}/", closing.address))).await;
    assert_eq!(reason, "127.0.0.1 closed the connection without an answer");

    let other = Receiver::start(|to| write(to, "220 mail.example ESMTP\r\n\r\n"));
    let reason = unreachable(&door(&format!("http://{}/", other.address))).await;
    assert!(reason.starts_with("127.0.0.1 does not answer in HTTP"), "{reason}");

    let unused = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let reason = unreachable(&door(&format!("http://{unused}/"))).await;
    assert_eq!(reason, "127.0.0.1 refuses connections: is the receiver running?");
}

/// A receiver that writes the beginning, then kilobytes of `x` until nobody reads, at most [`BUFFERED_BYTES`]; it reports
/// how many.
fn endless(beginning: &'static str) -> (Receiver, std::sync::mpsc::Receiver<usize>) {
    let (written, n_bytes) = channel();
    let receiver = Receiver::start(move |to| {
        write(to, beginning);
        let chunk = [b'x'; 1024];
        let n_chunks = (0..BUFFERED_BYTES / chunk.len()).take_while(|_| to.write_all(&chunk).is_ok()).count();
        written.send(n_chunks * chunk.len()).unwrap();
    });
    (receiver, n_bytes)
}

#[tokio::test]
async fn an_answer_that_never_ends_is_cut() {
    let (receiver, n_bytes) = endless("HTTP/1.1 500 Oops\r\n\r\n");
    let outcome = deliver(&door(&format!("http://{}/", receiver.address))).await;
    let expected = format!("the receiver answered 500 Internal Server Error: {}", "x".repeat(200));
    assert_eq!(outcome, Err(Undelivered::Refused(expected)));
    assert!(n_bytes.recv().unwrap() < BUFFERED_BYTES);
}

#[tokio::test]
async fn headers_that_never_end_are_cut() {
    let (receiver, n_bytes) = endless("HTTP/1.1 200 OK\r\n");
    let reason = unreachable(&door(&format!("http://{}/", receiver.address))).await;
    assert_eq!(reason, "127.0.0.1 answers with headers that are too large");
    assert!(n_bytes.recv().unwrap() < BUFFERED_BYTES);
}
