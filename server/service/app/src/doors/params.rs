//! Times and limits of deliveries.

use std::time::Duration;

/// Attempts to deliver an event that its receiver refuses, after the first one: delays as of Standard Webhooks, within
/// a day.
pub const RETRIES: [Duration; 7] = [
    Duration::from_secs(5),
    Duration::from_secs(5 * 60),
    Duration::from_secs(35 * 60),
    Duration::from_secs(2 * 3600 + 30 * 60),
    Duration::from_secs(7 * 3600 + 30 * 60),
    Duration::from_secs(17 * 3600 + 30 * 60),
    Duration::from_secs(24 * 3600),
];

/// Failed attempts after which a refused event lets later ones pass: that is 5 minutes after the first attempt.
pub const YIELDS_AFTER: u32 = 3;

/// Delays between attempts while a receiver cannot be reached: doubled from the first to the last one, which bounds
/// the wait once it is back.
pub const UNREACHABLE_FIRST: Duration = Duration::from_secs(1);
/// See [`UNREACHABLE_FIRST`].
pub const UNREACHABLE_LAST: Duration = Duration::from_secs(30);

/// Longest delay that a receiver may ask for.
pub const LONGEST_RETRY_AFTER: Duration = Duration::from_secs(3600);

/// Delays vary by up to this share, so that many senders do not return at the same moment.
pub const JITTER: f64 = 0.1;

/// Number of events read from the log at a time.
pub const EVENTS_AT_A_TIME: u32 = 100;

/// Delay after the store could not be read or written.
pub const STORE_RETRY: Duration = Duration::from_secs(5);

/// Number of events kept for a door that is behind, about 1 GiB; beyond that its oldest deliveries become dead letters.
pub const EVENTS_KEPT_FOR_DOORS: i64 = 2_000_000;

/// Attempts kept for the log of a door.
pub const ATTEMPTS_KEPT: usize = 100;
