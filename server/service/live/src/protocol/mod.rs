//! The bytes and texts of `sheaf.v1`, as `openapi/stream.md` specifies them, and its limits.

pub mod header;
pub mod image;
pub mod points;
pub mod profile;
pub mod text;

#[cfg(test)]
mod golden;

/// The WebSocket sub-protocol; another number is another protocol.
pub const SUB_PROTOCOL: &str = "sheaf.v1";
/// Largest message a client may send, bytes: a subscription to everything needs 500.
pub const MAX_CLIENT_MESSAGE_BYTES: usize = 16 * 1024;
/// Messages a client may send at once.
pub const CLIENT_MESSAGE_BURST: f64 = 50.0;
/// Average number of messages per second that a client may send: users do not click faster.
pub const CLIENT_MESSAGES_PER_S: f64 = 20.0;
/// Highest rate a client may ask for, Hz: no screen shows more.
pub const MAX_RATE_HZ: f64 = 240.0;
/// Rate of a subscription that names none, Hz.
pub const DEFAULT_RATE_HZ: f64 = 30.0;
/// Sockets at once.
pub const MAX_SOCKETS: usize = 200;

/// Why the server closes a socket.
pub mod close {
    /// Server shutdown.
    pub const GOING_AWAY: u16 = 1001;
    /// WebSocket protocol violation.
    pub const PROTOCOL: u16 = 1002;
    /// Text that is not UTF-8.
    pub const NOT_UTF8: u16 = 1007;
    /// A binary message from the client.
    pub const UNSUPPORTED: u16 = 1003;
    /// Too many messages from the client.
    pub const POLICY: u16 = 1008;
    /// A message above the limit.
    pub const TOO_BIG: u16 = 1009;
    /// The client sent nothing, or did not read.
    pub const SILENT: u16 = 4000;
}
