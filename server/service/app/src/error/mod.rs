//! The error of a use case: detail, cause and remedy. Every interface maps the kinds to its own codes; HTTP has its table
//! of them.

mod causes;

pub use causes::disk_problem;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The kinds of errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ErrorKind {
    /// The input is malformed.
    BadRequest,
    /// The resource does not exist.
    NotFound,
    /// The caller does not hold the control lease.
    ControlRequired,
    /// The control lease sent with the request has expired.
    ControlExpired,
    /// The station was stopped and has not been reset since.
    Halted,
    /// The station is busy with something else.
    StationBusy,
    /// The state of the resource does not allow it.
    Conflict,
    /// The resource was changed in the meantime.
    Changed,
    /// The body is too large.
    TooLarge,
    /// The request is well-formed but cannot be carried out.
    Impossible,
    /// Too many at once.
    TooMany,
    /// An internal error.
    Internal,
    /// A device does not answer, or the station is in error.
    DeviceFault,
    /// A stored file or record is damaged or missing.
    Damaged,
    /// The service is starting or shutting down.
    Unavailable,
    /// The disk is full.
    StorageFull,
    /// Stopped by a user.
    Stopped,
}

/// An error; stored as JSON with failed jobs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AppError {
    /// Its kind.
    pub kind: ErrorKind,
    /// What went wrong in this case.
    pub detail: String,
    /// The cause, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// What to do about it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remedy: Option<String>,
    /// Where in the input: a JSON pointer, a file or an entry.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pointer: Option<String>,
    /// Seconds after which to retry.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub retry_after_s: Option<u64>,
}

impl AppError {
    /// An error of this kind.
    pub fn new(kind: ErrorKind, detail: impl Into<String>) -> Self {
        Self { kind, detail: detail.into(), cause: None, remedy: None, pointer: None, retry_after_s: None }
    }

    /// Adds the remedy.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
        self
    }

    /// Adds the cause.
    pub fn because(mut self, cause: impl Into<String>) -> Self {
        self.cause = Some(cause.into());
        self
    }

    /// Adds the place in the input.
    pub fn at(mut self, pointer: impl Into<String>) -> Self {
        self.pointer = Some(pointer.into());
        self
    }

    /// Adds the time after which to retry.
    pub fn retry_after_s(mut self, seconds: u64) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }

    /// A stored file or record is damaged or missing; the remedy is the same.
    pub fn damaged(what: &str, cause: impl Into<String>) -> Self {
        Self::new(ErrorKind::Damaged, format!("{what} is damaged or missing in the store"))
            .because(cause)
            .remedy("restore the data directory from a backup, or create it again")
    }

    /// Replaces the name of a damaged artifact with a display name; other errors are returned unchanged.
    pub fn of_stored(self, what: &str) -> Self {
        match self.kind {
            ErrorKind::Damaged => Self::damaged(what, self.cause.unwrap_or_default()),
            _ => self,
        }
    }
}
