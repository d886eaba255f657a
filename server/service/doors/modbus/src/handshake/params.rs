//! Times and limits of the handshake.

use std::time::Duration;

/// A PLC whose heartbeat is silent for longer has stopped, or has lost its connection: nothing is started for it.
pub const PLC_SILENT: Duration = Duration::from_secs(2);

/// Step of the heartbeat of this server.
pub const HEARTBEAT_STEP: Duration = Duration::from_millis(100);

/// Results that may wait for acknowledgement before triggers are refused.
pub const RESULTS_MAY_WAIT: usize = 32;

/// After an acknowledgement, the next result is shown once the PLC has read that `valid` is 0, or after this time.
pub const LOW_AT_MOST: Duration = Duration::from_secs(1);
