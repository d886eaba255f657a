//! Times of the server.

use std::time::Duration;

/// A connection that is silent for so long is closed.
pub const IDLE: Duration = Duration::from_secs(60);

/// Only a connection that is silent for so long may be replaced by a new one: a PLC that polls keeps its own.
pub const REPLACEABLE: Duration = Duration::from_secs(1);

/// Delay after the port could not be opened.
pub const BIND_RETRY: Duration = Duration::from_secs(5);

/// Delay after a connection could not be accepted, as with too many open files.
pub const ACCEPT_RETRY: Duration = Duration::from_millis(100);
