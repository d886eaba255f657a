//! A laser: light is leased, and goes out when nobody renews the lease.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

use remedy::Remedy;

use crate::traits::camera::ValueRange;
use crate::{DeviceIdentity, StageError, StopHandle};

/// What the laser can do.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserCapabilities {
    /// Whether this program switches it. If not, it is on as long as it has power, and nothing that is said here of
    /// darkness holds for it.
    pub switched: bool,
    /// Powers it can be set to, as a share of full power; `None`: on and off only.
    pub power: Option<ValueRange>,
    /// Whether an interlock is read back.
    pub interlock: bool,
}

impl Default for LaserCapabilities {
    /// Switched on and off, and no more.
    fn default() -> Self {
        Self { switched: true, power: None, interlock: false }
    }
}

/// What a laser reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserState {
    /// Whether it shines, as far as the driver knows.
    pub emitting: bool,
    /// Share of full power it shines with; 0 when it does not.
    pub power: f64,
    /// `Some(true)`: the interlock is closed and light is possible; `None`: it is not read back.
    pub interlock_closed: Option<bool>,
}

/// Why a laser did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum LaserError {
    /// The interlock is open.
    #[error("the laser's interlock is open")]
    InterlockOpen,
    /// The laser or its driver reports a fault.
    #[error("the laser reports a fault: {reason}")]
    Fault {
        /// What it says.
        reason: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// The controller that it shares with the stage has a fault.
    #[error("the laser reports a fault: {0}")]
    Controller(StageError),
    /// A power that is not a share of full power.
    #[error("a laser cannot shine with power {value}")]
    BadPower {
        /// The value wanted.
        value: f64,
    },
    /// The controller refused or does not answer; whether light is on is unknown until it is reached again.
    #[error("the laser cannot be reached: {reason}")]
    Gone {
        /// What was noticed.
        reason: String,
    },
}

impl Remedy for LaserError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::InterlockOpen => "close doors and covers",
            Self::BadPower { .. } => "give a number above 0 and at most 1",
            Self::Gone { .. } => "check cable and power, then reconnect",
            Self::Controller(error) => return error.remedy(),
            Self::Fault { remedy, .. } => remedy,
        }))
    }
}

/// A laser.
pub trait Laser: Send {
    /// Which laser this is.
    fn identity(&self) -> DeviceIdentity;

    /// What it can do.
    fn capabilities(&self) -> LaserCapabilities;

    /// What becomes of the light if this program is killed, as the second half of a sentence that begins "if this
    /// program is killed,".
    fn lost_host(&self) -> &'static str {
        "it is not known how long the laser stays on"
    }

    /// Shines with a share `power` of full power (0 < power ≤ 1) for at most `lease`, unless renewed.
    ///
    /// The lease runs in the driver: it ends the light also when the caller hangs. It is cut to
    /// [`crate::LASER_LEASE_LIMIT`]. Returns what was accepted.
    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError>;

    /// Lets the light shine for `lease` from now; does not switch on what is off.
    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError>;

    /// Goes dark. Works in every state and may be called any number of times.
    fn switch_off(&mut self) -> Result<(), LaserError>;

    /// Turns it off from another thread while a call has not come back; `None` where [`LaserCapabilities::switched`] is
    /// false.
    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>>;

    /// What it does now.
    fn poll(&mut self) -> Result<LaserState, LaserError>;

    /// Starts to reach the laser again and returns at once; [`Laser::poll`] tells [`LaserError::Gone`] until it is
    /// reached. It comes back dark.
    fn reconnect(&mut self) -> Result<(), LaserError>;
}
