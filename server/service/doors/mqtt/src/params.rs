//! Times and limits of the door.

use std::time::Duration;

/// Silence after which the client pings the broker; after 1.5 times that the broker publishes the last will.
pub const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// How long connecting may take, with name resolution and TLS.
pub const CONNECT_TIMEOUT_S: u64 = 10;

/// How long the broker keeps the session after the connection broke.
pub const SESSION_EXPIRY_S: u32 = 3600;

/// Age at which the broker drops an event that a subscriber has not received yet.
pub const MESSAGE_EXPIRY_S: u32 = 24 * 3600;

/// Messages on their way at a time; the door itself sends one event after the other, and the state beside it.
pub const UNACKNOWLEDGED_MESSAGES: u16 = 16;

/// Largest PUBLISH packet without topic and payload: header 1 + 4, length of the topic 2, packet id 2, properties 1 + 2
/// (payload format) + 5 (expiry) + 3 + 16 (content type).
pub const PACKET_OVERHEAD_BYTES: usize = 36;

/// Longest expiry of a command: a part or a person may have moved since.
pub const COMMAND_EXPIRY_S: u32 = 5;

/// Longest id of a command: that of an order with a counter, or a UUID.
pub const COMMAND_ID_CHARS: usize = 100;

/// Commands that wait, and answers: more than a person or a line control sends while one is executed.
pub const COMMANDS_WAITING: usize = 16;

/// Age at which the broker drops an answer that nobody fetched: its client waits no longer.
pub const ANSWER_EXPIRY_S: u32 = 60;

/// Largest packet that this client receives; the broker drops larger messages.
pub const INCOMING_PACKET_BYTES: u32 = 64 * 1024;

/// Shortest time between a birth and the next one that a host asks for: several hosts ask at the same time.
pub const BIRTH_INTERVAL: Duration = Duration::from_secs(1);

/// Delay before a message without acknowledgement is handed over again to the client library, whose queue was full.
pub const HANDED_OVER_AGAIN: Duration = Duration::from_millis(5);

/// Times that tests shorten.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    /// How long a message may take to be acknowledged, with connecting.
    pub acknowledged_within: Duration,
    /// Delays between attempts to connect: doubled from the first to the last one.
    pub reconnect_first: Duration,
    /// See `reconnect_first`. A connection that lasted longer counts as a success, after which the first delay applies.
    pub reconnect_last: Duration,
    /// Shortest time between two messages about the health.
    pub health_interval: Duration,
    /// How long saying goodbye may take at the end.
    pub goodbye_within: Duration,
}

impl Default for Times {
    fn default() -> Self {
        Self {
            acknowledged_within: Duration::from_secs(20),
            reconnect_first: Duration::from_secs(1),
            reconnect_last: Duration::from_secs(30),
            health_interval: Duration::from_secs(10),
            goodbye_within: Duration::from_secs(2),
        }
    }
}
