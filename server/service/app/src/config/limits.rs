//! What the use cases take at most, and how long they wait: one place, stated to clients as errors.

use std::time::Duration;

/// The control lease: long enough for a lost packet, short enough for a closed laptop.
pub const CONTROL_LEASE: Duration = Duration::from_secs(5);

/// Control lapses so long after the last command: long enough to look at a result, short enough for whoever waits.
pub const CONTROL_IDLE: Duration = Duration::from_secs(120);

/// Time between two looks whether control has lapsed.
pub const CONTROL_WATCH: Duration = Duration::from_millis(500);

/// How long an `Idempotency-Key` is remembered, ms.
pub const IDEMPOTENCY_KEPT_MS: i64 = 7 * 24 * 3600 * 1000;

/// Events that are kept at least; older ones are pruned so that months of work stay small.
pub const EVENTS_KEPT: i64 = 200_000;

/// How long a job that has ended is shown: what it made has records of its own.
pub const JOBS_KEPT_MS: i64 = 30 * 24 * 3600 * 1000;

/// Jobs that are kept at most, those that wait or run beside them: a page of a busy month.
pub const JOBS_KEPT: u32 = 10_000;

/// Time between two sweeps: deletions come in bursts, and one sweep does for all of them.
pub const SWEEP_PAUSE: Duration = Duration::from_secs(1);

/// How often old records are looked for.
pub const HOUSEKEEPING_PERIOD: Duration = Duration::from_secs(3600);

/// Time for requests under way to end once the service is asked to end.
pub const DRAIN_TIMEOUT: Duration = Duration::from_secs(3);

/// Free space below which no job is begun: room for the catalogue, its log and the deletions that make room.
pub const FREE_FLOOR_BYTES: u64 = 256 << 20;
