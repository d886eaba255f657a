//! Why a method was refused.

use app::error::{AppError, ErrorKind};

/// A reason, with its number in the output argument `Error`; 0 is none. The numbers are those of the Modbus door.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Another job runs.
    Busy = 2,
    /// No such recipe.
    NoRecipe = 3,
    /// The station is stopped.
    Stopped = 4,
    /// The station is in error.
    Fault = 5,
    /// Someone else is in control.
    NotInControl = 6,
    /// The serial number cannot be used.
    BadSerial = 7,
    /// Too many jobs wait.
    QueueFull = 8,
    /// The station is not ready, or nothing runs.
    NotReady = 9,
    /// The service cannot do it now.
    Unavailable = 12,
    /// No such result.
    NoResult = 13,
}

impl Refusal {
    /// Its number.
    pub fn number(self) -> i32 {
        self as i32
    }

    /// The reason of this error; what a client cannot act on is in the log.
    pub fn of(error: &AppError) -> Self {
        let refusal = match (error.kind, error.pointer.as_deref()) {
            (_, Some("/serial")) => Self::BadSerial,
            (_, Some(pointer)) if pointer.starts_with("/recipe") => Self::NoRecipe,
            (ErrorKind::ControlRequired | ErrorKind::ControlExpired, _) => Self::NotInControl,
            (ErrorKind::Halted | ErrorKind::Stopped, _) => Self::Stopped,
            (ErrorKind::StationBusy, _) => Self::Busy,
            (ErrorKind::TooMany, _) => Self::QueueFull,
            (ErrorKind::DeviceFault, _) => Self::Fault,
            (ErrorKind::NotFound, _) => Self::NoResult,
            (ErrorKind::Conflict | ErrorKind::Impossible, _) => Self::NotReady,
            _ => Self::Unavailable,
        };
        tracing::info!(code = refusal.number(), error = error.detail, cause = error.cause, "a method was refused");
        refusal
    }
}
