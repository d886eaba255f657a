//! The edge: slow and silent clients, the connection limit, foreign hosts and origins.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use crate::common::server::Server;
use crate::http::fresh;

/// Promised: slow or silent connections are closed within this time.
const CLOSED_WITHIN: Duration = Duration::from_secs(15);

fn connect(server: &Server) -> TcpStream {
    let stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream
}

/// Sends `begin`, then `drip` once per second; returns the lifetime of the connection and the response.
fn lived(server: &Server, begin: &str, drip: u8) -> (Duration, String) {
    let mut stream = connect(server);
    let begun = Instant::now();
    stream.write_all(begin.as_bytes()).unwrap();
    let mut slow = stream.try_clone().unwrap();
    let dripping = std::thread::spawn(move || {
        while begun.elapsed() < Duration::from_secs(60) && (drip == 0 || slow.write_all(&[drip]).is_ok()) {
            std::thread::sleep(Duration::from_secs(1));
            if drip == 0 {
                return;
            }
        }
    });
    let mut said = Vec::new();
    // A reset also ends the connection.
    let _ = stream.read_to_end(&mut said);
    let lived = begun.elapsed();
    dripping.join().unwrap();
    (lived, String::from_utf8_lossy(&said).into_owned())
}

#[test]
fn slow_and_silent_clients_are_closed_within_fifteen_seconds() {
    let (_folder, server) = fresh();
    let host = server.address().to_owned();
    let body = format!(
        "POST /api/v1/scans HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: 5000\r\n\r\n{{"
    );
    let upload = body.replace("/scans", "/captures").replace("application/json", "application/zip");
    let cases = [
        ("silent", String::new(), 0),
        ("header", format!("GET /health HTTP/1.1\r\nHost: {host}\r\nX-Slow: "), b'a'),
        ("kept open", format!("GET /health HTTP/1.1\r\nHost: {host}\r\n\r\n"), 0),
        ("body", body, b' '),
        ("upload", upload, b' '),
    ];
    std::thread::scope(|scope| {
        let running = cases.map(|(name, begin, drip)| {
            let server = &server;
            (name, scope.spawn(move || lived(server, &begin, drip)))
        });
        for (name, running) in running {
            let (lived, said) = running.join().unwrap();
            assert!(lived < CLOSED_WITHIN, "{name} lived {lived:?} and got {said}");
            if matches!(name, "body" | "upload") {
                assert!(said.starts_with("HTTP/1.1 408"), "{name}: {said}");
            }
        }
    });
    server.get("/health").expect(200);
}

#[test]
fn stop_works_beyond_the_connection_limit() {
    let (_folder, server) = fresh();
    server.get("/health").expect(200);
    let host = server.address().to_owned();
    let mut held: Vec<TcpStream> = Vec::new();
    // One more than the limit; each is known to be accepted or refused.
    let refused = (0..1_001).find(|_| {
        let mut stream = connect(&server);
        write!(stream, "GET /health HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
        let mut first = [0; 12];
        stream.read_exact(&mut first).unwrap();
        let full = &first == b"HTTP/1.1 503";
        held.push(stream);
        full
    });
    assert!(refused.is_some(), "all of {} connections were taken in", held.len());
    let mut stop = connect(&server);
    write!(stop, "POST /api/v1/station/stop HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n\r\n").unwrap();
    let mut said = String::new();
    stop.read_to_string(&mut said).unwrap();
    assert!(said.starts_with("HTTP/1.1 200"), "{said}");
}

#[test]
fn foreign_hosts_and_origins_are_refused() {
    let (_folder, server) = fresh();
    let get = |headers: &[(&str, &str)]| server.send("GET", "/api/v1/station", headers, &[]).status;
    assert_eq!(get(&[("host", "evil.example")]), 403);
    assert_eq!(get(&[("host", "localhost")]), 200);
    let post = |headers: &[(&str, &str)]| server.send("PUT", "/api/v1/simulation/scene", headers, b"{}").status;
    assert_eq!(post(&[("origin", "http://evil.example")]), 403);
    let own = format!("http://{}", server.address());
    assert_eq!(post(&[("origin", &own), ("content-type", "application/json")]), 422);
}

#[test]
fn every_response_has_security_headers() {
    let (_folder, server) = fresh();
    for path in ["/health", "/api/v1/station", "/api/v1/nothing", "/docs/"] {
        let answer = server.get(path);
        assert_eq!(answer.header("x-content-type-options"), Some("nosniff"), "{path}");
        let policy = answer.header("content-security-policy").unwrap();
        assert!(policy.contains("default-src 'none'") && policy.contains("frame-ancestors 'none'"), "{path}");
    }
    let page = String::from_utf8(server.get("/docs/").body).unwrap();
    assert!(!page.contains("https://") && !page.contains("src=\"//"), "{page}");
}

#[test]
fn websocket_protocol_errors_close_with_1002() {
    let (_folder, server) = fresh();
    let mut stream = connect(&server);
    write!(
        stream,
        "GET /api/v1/stream HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Protocol: sheaf.v1\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        server.address()
    )
    .unwrap();
    // A text frame without the mask that clients must use.
    stream.write_all(&[0x81, 2, b'h', b'i']).unwrap();
    let mut said = Vec::new();
    stream.read_to_end(&mut said).unwrap();
    let farewell = said.windows(4).any(|bytes| bytes[0] == 0x88 && bytes[2..] == 1002_u16.to_be_bytes());
    assert!(farewell, "{}", String::from_utf8_lossy(&said));
}
