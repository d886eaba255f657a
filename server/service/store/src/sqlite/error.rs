//! SQLite errors as errors of the store.

use sqlx::Error;

use crate::error::StoreError;
use crate::health::Health;

/// Primary result codes (sqlite.org/rescode.html).
const BUSY: i32 = 5;
const READONLY: i32 = 8;
const IOERR: i32 = 10;
const CORRUPT: i32 = 11;
const FULL: i32 = 13;
const CANTOPEN: i32 = 14;
/// Extended code: the shared index of the log could not grow, which happens on a full disk only.
const IOERR_SHMSIZE: i32 = IOERR | (19 << 8);

fn extended_code(error: &Error) -> Option<i32> {
    match error {
        Error::Database(cause) => cause.code()?.parse().ok(),
        _ => None,
    }
}

fn primary_code(error: &Error) -> Option<i32> {
    extended_code(error).map(|code| code & 0xff)
}

/// Whether another connection held a lock for too long.
pub fn is_busy(error: &Error) -> bool {
    primary_code(error) == Some(BUSY)
}

/// Whether the disk is full.
fn is_full(error: &Error) -> bool {
    primary_code(error) == Some(FULL) || extended_code(error) == Some(IOERR_SHMSIZE)
}

/// An error while reading.
pub fn reading(cause: Error, what: &'static str) -> StoreError {
    StoreError::Database { what, cause: Box::new(cause) }
}

/// An error while writing; an I/O error makes the store read-only.
pub fn writing(cause: Error, what: &'static str, health: &Health) -> StoreError {
    if is_full(&cause) {
        return StoreError::Full;
    }
    let disk_failed = match primary_code(&cause) {
        Some(code) => matches!(code, READONLY | IOERR | CORRUPT | CANTOPEN),
        None => matches!(cause, Error::Io(_) | Error::WorkerCrashed),
    };
    if disk_failed {
        return health.fail(format!("cannot {what}: {cause}"));
    }
    StoreError::Database { what, cause: Box::new(cause) }
}

/// An error while opening or copying.
pub fn opening(cause: Error, what: &'static str) -> StoreError {
    if is_full(&cause) { StoreError::Full } else { reading(cause, what) }
}

/// Whether a foreign key refers to a row that does not exist.
pub fn is_dangling(error: &Error) -> bool {
    matches!(error, Error::Database(cause) if cause.is_foreign_key_violation())
}
