//! Local time, as Q-DAS files and names of files have it.

use time::{OffsetDateTime, UtcOffset};

/// Milliseconds since 1970 in the time zone of this machine, UTC if it is unknown; `None` beyond the year 9999.
pub fn local(at_ms: i64) -> Option<OffsetDateTime> {
    let at = OffsetDateTime::from_unix_timestamp_nanos(i128::from(at_ms) * 1_000_000).ok()?;
    let offset = UtcOffset::local_offset_at(at).unwrap_or(UtcOffset::UTC);
    at.checked_to_offset(offset)
}

/// The present difference of local time from UTC, for the log; `None` if the time zone is unknown.
pub fn offset_now() -> Option<UtcOffset> {
    UtcOffset::current_local_offset().ok()
}
