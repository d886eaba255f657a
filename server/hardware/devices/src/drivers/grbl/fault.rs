//! Faults of a controller, which persist until they are cleared.

use super::Dialect;
use super::meanings::{alarm_meaning, error_meaning};
use crate::{LaserError, StageError};

/// The device whose command was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Device {
    Stage,
    Laser,
}

/// A fault; reported at every poll.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    Alarm { code: u32, dialect: Dialect },
    Refused { command: String, code: u32, by: Device },
    Restarted,
    Stalled { target_mm: f64, actual_mm: f64 },
    StrayLight,
    NoResponse { command: String, waited_ms: u64 },
    Unreadable { received: String },
    Disconnected { reason: String },
    WrongDevice { port_name: String, expected: String, found: String },
}

impl Fault {
    /// Whether only reopening the line helps.
    pub fn needs_reconnect(&self) -> bool {
        match self {
            Fault::NoResponse { .. }
            | Fault::Unreadable { .. }
            | Fault::Disconnected { .. }
            | Fault::WrongDevice { .. } => true,
            Fault::Alarm { .. }
            | Fault::Refused { .. }
            | Fault::Restarted
            | Fault::Stalled { .. }
            | Fault::StrayLight => false,
        }
    }

    /// Whether it concerns this device: a refused command concerns only the device that sent it.
    pub fn concerns(&self, device: Device) -> bool {
        !matches!(self, Fault::Refused { by, .. } if *by != device)
    }

    pub fn for_stage(&self) -> StageError {
        match self.clone() {
            Fault::Alarm { code, dialect } => {
                StageError::Alarm { code, meaning: alarm_meaning(dialect, code).to_owned() }
            }
            Fault::Refused { command, code, .. } => {
                StageError::Refused { command, code, meaning: error_meaning(code).to_owned() }
            }
            Fault::Restarted => StageError::Restarted,
            Fault::Stalled { target_mm, actual_mm } => StageError::Stalled { target_mm, actual_mm },
            Fault::StrayLight => StageError::Disconnected {
                reason: "the laser was on without a request; the controller was reset".to_owned(),
            },
            Fault::NoResponse { command, waited_ms } => StageError::NoResponse { command, waited_ms },
            Fault::Unreadable { received } => StageError::Unreadable { received },
            Fault::Disconnected { reason } => StageError::Disconnected { reason },
            Fault::WrongDevice { port_name, expected, found } => {
                StageError::WrongDevice { port_name, expected, found }
            }
        }
    }

    /// Over a working link the laser is known to be off, so that only its own faults concern it.
    pub fn for_laser(&self) -> LaserError {
        let fault = self.for_stage();
        if self.needs_reconnect() {
            LaserError::Disconnected { reason: fault.to_string() }
        } else {
            LaserError::Controller(fault)
        }
    }
}
