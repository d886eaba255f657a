//! A controller connected over TCP instead of a serial port: FluidNC's telnet port, or a serial server.
//!
//! Bytes are passed unchanged. A telnet server may negotiate options; its requests are removed from the input and not
//! answered, so that it keeps its defaults.

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use crate::lines::serial_line::{SerialLine, SerialLineError, SerialWriter, WRITE_LIMIT};

/// Prefix of the port setting for a TCP connection.
pub const SCHEME: &str = "tcp://";

/// Longest wait for a connection, a part of the longest opening.
const CONNECT_LIMIT: Duration = Duration::from_secs(2);

/// "Interpret as command" of telnet (RFC 854).
const IAC: u8 = 0xff;
/// WILL, WON'T, DO, DON'T: an option follows.
const NEGOTIATIONS: std::ops::RangeInclusive<u8> = 251..=254;

/// A TCP connection to `host:port`.
pub struct TcpLine {
    address: String,
    stream: Option<TcpStream>,
    telnet: Telnet,
}

impl TcpLine {
    /// To `host:port`, not connected yet.
    pub fn new(address: &str) -> Self {
        Self { address: address.to_owned(), stream: None, telnet: Telnet::default() }
    }

    fn connected(&self) -> Result<TcpStream, std::io::Error> {
        let began_at = Instant::now();
        let mut failure = std::io::Error::new(ErrorKind::NotFound, "the name has no address");
        for address in self.address.to_socket_addrs()? {
            let left = CONNECT_LIMIT.saturating_sub(began_at.elapsed()).max(Duration::from_millis(1));
            match TcpStream::connect_timeout(&address, left) {
                Ok(stream) => {
                    // A single byte is sent at once.
                    stream.set_nodelay(true)?;
                    stream.set_write_timeout(Some(WRITE_LIMIT))?;
                    return Ok(stream);
                }
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }
}

impl SerialLine for TcpLine {
    fn port_name(&self) -> String {
        format!("{SCHEME}{}", self.address)
    }

    fn reopen(&mut self) -> Result<(), SerialLineError> {
        self.close();
        let stream = self
            .connected()
            .map_err(|cause| SerialLineError::ConnectFailed { port_name: self.port_name(), cause })?;
        self.stream = Some(stream);
        Ok(())
    }

    fn close(&mut self) {
        (self.stream, self.telnet) = (None, Telnet::default());
    }

    fn read(&mut self, buffer: &mut [u8], wait: Duration) -> Result<usize, SerialLineError> {
        let port_name = self.port_name();
        let Some(stream) = &mut self.stream else { return Err(SerialLineError::Closed { port_name }) };
        let disconnected = |cause| SerialLineError::Disconnected { port_name: port_name.clone(), cause };
        stream
            .set_read_timeout(Some(wait.max(Duration::from_millis(1))))
            .map_err(|error| disconnected(Some(error)))?;
        match stream.read(buffer) {
            Ok(0) => Err(disconnected(None)),
            Ok(n) => Ok(self.telnet.strip(&mut buffer[..n])),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                ) =>
            {
                Ok(0)
            }
            Err(error) => Err(disconnected(Some(error))),
        }
    }

    fn writer(&self) -> Result<Box<dyn SerialWriter>, SerialLineError> {
        let port_name = self.port_name();
        let Some(stream) = &self.stream else { return Err(SerialLineError::Closed { port_name }) };
        let stream = stream
            .try_clone()
            .map_err(|cause| SerialLineError::ConnectFailed { port_name: port_name.clone(), cause })?;
        Ok(Box::new(TcpWriter { port_name, stream }))
    }
}

struct TcpWriter {
    port_name: String,
    stream: TcpStream,
}

impl SerialWriter for TcpWriter {
    fn write_now(&mut self, bytes: &[u8]) -> Result<(), SerialLineError> {
        self.stream.write_all(bytes).map_err(|error| match error.kind() {
            ErrorKind::TimedOut | ErrorKind::WouldBlock => {
                SerialLineError::Blocked { port_name: self.port_name.clone() }
            }
            _ => SerialLineError::Disconnected { port_name: self.port_name.clone(), cause: Some(error) },
        })
    }
}

/// Removes a telnet server's negotiations from the input.
#[derive(Debug, Default)]
struct Telnet {
    state: State,
}

#[derive(Debug, Default, Clone, Copy)]
enum State {
    #[default]
    Text,
    Command,
    Option,
}

impl Telnet {
    /// Moves text to the front of `bytes`; returns its length.
    fn strip(&mut self, bytes: &mut [u8]) -> usize {
        let mut n = 0;
        for at in 0..bytes.len() {
            let byte = bytes[at];
            self.state = match self.state {
                State::Text if byte == IAC => State::Command,
                State::Command if NEGOTIATIONS.contains(&byte) => State::Option,
                State::Command | State::Option => State::Text,
                State::Text => {
                    bytes[n] = byte;
                    n += 1;
                    State::Text
                }
            };
        }
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negotiations_are_left_out_also_where_they_come_in_pieces() {
        let mut telnet = Telnet::default();
        let mut first = *b"Gr\xff";
        assert_eq!(telnet.strip(&mut first), 2);
        let mut second = *b"\xfd\x03bl\xff\xf9!";
        assert_eq!(telnet.strip(&mut second), 3);
        assert_eq!((&first[..2], &second[..3]), (&b"Gr"[..], &b"bl!"[..]));
    }

    #[test]
    fn an_address_without_a_listener_is_reported() {
        let mut line = TcpLine::new("127.0.0.1:1");
        let refusal = line.reopen().unwrap_err();
        assert!(refusal.to_string().contains("tcp://127.0.0.1:1"), "{refusal}");
    }
}
