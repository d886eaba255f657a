//! States of the connection, and its end.

use rumqttc::v5::ConnectionError;

/// State of the connection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkState {
    /// Being established.
    Connecting,
    /// Established.
    Up {
        /// Its number since the start.
        connection: u64,
        /// Largest packet that the broker accepts.
        max_packet_bytes: Option<u32>,
    },
    /// Not established; the next attempt follows after a delay.
    Down {
        /// Why.
        reason: String,
    },
    /// Ended for good.
    Closed,
}

/// Why a connection ended.
pub enum Ending {
    /// This side said goodbye.
    Goodbye,
    /// It failed.
    Failed(ConnectionError),
    /// It is of no use, for this reason.
    Useless(String),
}
