//! Constants of the queue, each with its reason.

use std::time::Duration;

/// Jobs that may wait (`promises.md` 9).
pub const QUEUE_LIMIT: usize = 32;

/// Retry time of a client refused by a full queue: about the duration of a scan.
pub const RETRY_AFTER_S: u64 = 10;

/// Minimum interval of publishing progress: faster is not readable.
pub const PUBLISH_INTERVAL: Duration = Duration::from_millis(100);

/// Interval of storing progress: shows after a crash roughly how far the job had come.
pub const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(10);

/// The remaining time is not estimated before this much time has elapsed …
pub const GUESS_AFTER_S: f64 = 1.0;

/// … and this much is done: before that, set-up dominates and the estimate would be unreliable.
pub const GUESS_AFTER_FRACTION: f64 = 0.03;

/// Time constant of smoothing the estimated remaining time.
pub const GUESS_MEMORY_S: f64 = 3.0;

/// Number of ended jobs searched for similar ones.
pub const FORECAST_JOBS: u32 = 100;

/// Number of similar jobs used for a forecast: tolerates an outlier and follows a change.
pub const FORECAST_ALIKE: usize = 5;

/// Disk space assumed for a scan of a capture, whose length is unknown: peaks, cloud and display points of a thousand
/// frames. For a scan on the station the plan gives the value, including kept images.
pub const SCAN_BYTES: u64 = 512 << 20;

/// How long a job may take to end when the service shuts down.
pub const SHUT_DOWN_LIMIT: Duration = Duration::from_secs(5);
