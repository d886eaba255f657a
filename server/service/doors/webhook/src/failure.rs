//! Why a request got no answer, as a sentence for a user.

use std::io::ErrorKind;
use std::time::Duration;

use ureq::Error;

/// `host`: the receiver; `timeout`: of the attempt.
pub fn reason(error: &Error, host: &str, timeout: Duration) -> String {
    match error {
        Error::Other(unconnectable) => unconnectable.to_string(),
        Error::Timeout(_) => late(host, timeout),
        Error::Io(error) => match error.kind() {
            ErrorKind::TimedOut | ErrorKind::WouldBlock => late(host, timeout),
            ErrorKind::ConnectionRefused => format!("{host} refuses connections: is the receiver running?"),
            ErrorKind::HostUnreachable | ErrorKind::NetworkUnreachable => format!("there is no route to {host}"),
            ErrorKind::UnexpectedEof
            | ErrorKind::ConnectionReset
            | ErrorKind::ConnectionAborted
            | ErrorKind::BrokenPipe => format!("{host} closed the connection without an answer"),
            // The TLS library reports its errors as such.
            ErrorKind::InvalidData => format!("no secure connection to {host}: {error}"),
            _ => format!("no connection to {host}: {error}"),
        },
        Error::Rustls(error) => format!("no secure connection to {host}: {error}"),
        Error::Tls(error) => format!("no secure connection to {host}: {error}"),
        Error::TlsRequired => format!("no secure connection to {host}"),
        Error::Protocol(error) => format!("{host} does not answer in HTTP: {error}"),
        Error::LargeResponseHeader(..) => format!("{host} answers with headers that are too large"),
        error => format!("the request to {host} failed: {error}"),
    }
}

fn late(host: &str, timeout: Duration) -> String {
    format!("{host} did not answer within {} s", timeout.as_secs())
}
