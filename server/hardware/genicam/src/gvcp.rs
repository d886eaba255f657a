//! Two queries to a GigE Vision camera that the library does not make: whether it is connected, answered in
//! milliseconds instead of seconds, and who controls it, answered also to programs without control.
//!
//! Read-register command of the GigE Vision Control Protocol (GVCP, port 3956): key 0x42, flags 0x01, command 0x0080,
//! length 4, request id, address; the acknowledgement is status, 0x0081, length 4, the same id, value; big-endian.

use std::net::{IpAddr, Ipv4Addr, UdpSocket};
use std::time::{Duration, Instant};

/// Port of the control protocol.
const PORT: u16 = 3956;

/// Control channel privilege: bits 0 and 1 are set while a program controls the camera.
const PRIVILEGE: u32 = 0x0A00;

/// Address of the controlling program; 0 on cameras that do not report it.
const CONTROLLER_ADDRESS: u32 = 0x0A14;

/// Timeout of one answer; cameras answer within a few milliseconds.
const RESPONSE_TIMEOUT: Duration = Duration::from_millis(120);

/// Queries before a camera counts as silent: a datagram may be lost.
const ATTEMPTS: u16 = 3;

/// Who controls a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Control {
    /// No program.
    Free,
    /// A program at this address, if the camera reports it.
    Held(Option<Ipv4Addr>),
}

/// Name of the protocol of these cameras in the library.
pub const PROTOCOL: &str = "GigEVision";

/// Queries who controls the camera at `address`; `None` if it does not answer, or the address is invalid.
pub fn control(address: &str) -> Option<Control> {
    let address: IpAddr = address.parse().ok()?;
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).ok()?;
    socket.connect((address, PORT)).ok()?;
    match read(&socket, PRIVILEGE, 1)? {
        // A camera that refuses reading is controlled by another program.
        Err(_refused) => Some(Control::Held(None)),
        Ok(bits) if bits & 0b11 == 0 => Some(Control::Free),
        Ok(_) => {
            let controller = read(&socket, CONTROLLER_ADDRESS, 100).and_then(Result::ok);
            Some(Control::Held(controller.filter(|&bits| bits != 0).map(Ipv4Addr::from)))
        }
    }
}

/// Reads a register; the inner error is the status of the acknowledgement.
fn read(socket: &UdpSocket, register: u32, first_id: u16) -> Option<Result<u32, u16>> {
    for id in first_id..first_id + ATTEMPTS {
        let mut request = [0x42, 0x01, 0x00, 0x80, 0x00, 0x04, 0, 0, 0, 0, 0, 0];
        request[6..8].copy_from_slice(&id.to_be_bytes());
        request[8..].copy_from_slice(&register.to_be_bytes());
        // If nothing listens, the next call returns an error; it may listen again at the next attempt.
        let _ = socket.send(&request);
        let deadline = Instant::now() + RESPONSE_TIMEOUT;
        while let Some(left) = deadline.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) {
            socket.set_read_timeout(Some(left)).ok()?;
            let mut answer = [0; 64];
            match socket.recv(&mut answer) {
                Ok(size) => {
                    if let Some(value) = value_of(&answer[..size], first_id..=id) {
                        return Some(value);
                    }
                }
                // Refused at once: the timeout is waited for all the same, so that the attempts span a restart of the
                // link.
                Err(error) if error.kind() == std::io::ErrorKind::ConnectionRefused => {
                    std::thread::sleep(left);
                }
                Err(_) => break,
            }
        }
    }
    None
}

/// The content of an acknowledgement of one of `ids`.
fn value_of(answer: &[u8], ids: std::ops::RangeInclusive<u16>) -> Option<Result<u32, u16>> {
    let word = |at: usize| Some(u16::from_be_bytes(answer.get(at..at + 2)?.try_into().ok()?));
    let (status, command, id) = (word(0)?, word(2)?, word(6)?);
    if command != 0x0081 || !ids.contains(&id) {
        return None;
    }
    if status != 0 {
        return Some(Err(status));
    }
    Some(Ok(u32::from_be_bytes(answer.get(8..12)?.try_into().ok()?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_to_other_requests_and_errors_are_distinguished() {
        let answer = [0, 0, 0, 0x81, 0, 4, 0, 7, 0, 0, 0, 2];
        assert_eq!(value_of(&answer, 7..=7), Some(Ok(2)));
        assert_eq!(value_of(&answer, 8..=9), None, "another request's");
        assert_eq!(value_of(&answer[..11], 7..=7), None, "cut short");
        let refused = [0x80, 0x06, 0, 0x81, 0, 0, 0, 7];
        assert_eq!(value_of(&refused, 7..=7), Some(Err(0x8006)));
        assert_eq!(control("not an address"), None);
    }
}
