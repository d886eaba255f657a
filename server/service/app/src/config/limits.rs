//! Limits and timeouts of the use cases, in one place; clients see them as errors.

use std::time::Duration;

/// The control lease: long enough for a lost packet, short enough for a closed laptop.
pub const CONTROL_LEASE: Duration = Duration::from_secs(5);

/// Idle limit of control after the last command: long enough to look at a result, short enough for others who wait.
pub const CONTROL_IDLE: Duration = Duration::from_secs(120);

/// Interval of checking whether control has expired.
pub const CONTROL_WATCH: Duration = Duration::from_millis(500);

/// How long an `Idempotency-Key` is kept, ms.
pub const IDEMPOTENCY_KEPT_MS: i64 = 7 * 24 * 3600 * 1000;

/// Minimum number of events kept; older ones are pruned to bound the size.
pub const EVENTS_KEPT: i64 = 200_000;

/// How long an ended job is kept: its results have records of their own.
pub const JOBS_KEPT_MS: i64 = 30 * 24 * 3600 * 1000;

/// Maximum number of ended jobs kept: about a busy month.
pub const JOBS_KEPT: u32 = 10_000;

/// Minimum interval between two sweeps: deletions come in bursts, and one sweep handles them all.
pub const SWEEP_PAUSE: Duration = Duration::from_secs(1);

/// Interval of pruning old records.
pub const HOUSEKEEPING_PERIOD: Duration = Duration::from_secs(3600);

/// Time for running requests to finish at shutdown.
pub const DRAIN_TIMEOUT: Duration = Duration::from_secs(3);

/// Free space below which no job is started: reserve for the catalogue, its log and deletions.
pub const FREE_FLOOR_BYTES: u64 = 256 << 20;
