//! Times and limits of webhooks.

use std::ops::RangeInclusive;
use std::time::Duration;

/// What is read of an answer; the rest is not needed.
pub const ANSWER_LIMIT_BYTES: u64 = 64 * 1024;

/// What is shown of an answer, in characters.
pub const EXCERPT_CHARS: usize = 200;

/// Length of a secret, as of Standard Webhooks.
pub const SECRET_BYTES: RangeInclusive<usize> = 24..=64;

/// Time for an attempt, in which a receiver may be slow to answer: Standard Webhooks recommends 15 to 30 s.
pub const TIMEOUT_S: u64 = 20;

/// What may be set for it.
pub const TIMEOUTS_S: RangeInclusive<u64> = 1..=60;

/// Age of an event at which its delivery is given up: that of the last attempt for one that is refused.
pub const GIVES_UP_AFTER: Duration = Duration::from_secs(24 * 3600);
