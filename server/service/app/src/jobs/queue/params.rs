//! Constants of the queue, each with its reason.

use std::time::Duration;

/// Jobs that may wait (`promises.md` 9).
pub const QUEUE_LIMIT: usize = 32;

/// When a client refused by a full queue may try again: the order of a scan.
pub const RETRY_AFTER_S: u64 = 10;

/// Progress is published at most this often: a person reads no faster.
pub const PUBLISH_INTERVAL: Duration = Duration::from_millis(100);

/// Progress is stored this often: after a crash a person wants to know roughly how far the job had come.
pub const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(10);

/// Time left is not guessed before so much time has passed …
pub const GUESS_AFTER_S: f64 = 1.0;

/// … and so much is done: before, set-up dominates and the guess would be wild.
pub const GUESS_AFTER_FRACTION: f64 = 0.03;

/// Time over which a guess of the time left gives way to the new ones.
pub const GUESS_MEMORY_S: f64 = 3.0;

/// Ended jobs that are looked through for the time of the next one.
pub const FORECAST_JOBS: u32 = 100;

/// Jobs like it that are learned from: one odd one does not matter, a change of the machine is followed.
pub const FORECAST_ALIKE: usize = 5;

/// Bytes a scan of unknown length, of a capture, is assumed to need: peaks, cloud and display points of a thousand
/// frames. A scan from the station needs what its plan says, its kept pictures included.
pub const SCAN_BYTES: u64 = 512 << 20;

/// How long a job may take to end when the service shuts down.
pub const SHUT_DOWN_LIMIT: Duration = Duration::from_secs(5);
