//! A laser: it is leased, and goes off unless the lease is renewed.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

use remedy::Remedy;

use crate::traits::camera::ValueRange;
use crate::{DeviceIdentity, StageError, StopHandle};

/// Capabilities of the laser.
#[derive(Debug, Clone, PartialEq)]
pub struct LaserCapabilities {
    /// Whether this program switches it. If not, it is on as long as it has power, and none of the guarantees about it
    /// being off hold.
    pub switched: bool,
    /// Range of power as a fraction of full power; `None` if it can only be switched on and off.
    pub power: Option<ValueRange>,
    /// Whether an interlock is monitored.
    pub interlock: bool,
}

impl Default for LaserCapabilities {
    /// A laser that can only be switched on and off.
    fn default() -> Self {
        Self { switched: true, power: None, interlock: false }
    }
}

/// State of a laser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaserState {
    /// Whether it is on, as far as the driver knows.
    pub emitting: bool,
    /// Power as a fraction of full power; 0 when it is off.
    pub power: f64,
    /// `Some(true)`: the interlock is closed and the laser can be on; `None`: not monitored.
    pub interlock_closed: Option<bool>,
}

/// Why a laser refused or failed.
#[derive(Debug, thiserror::Error)]
pub enum LaserError {
    /// The interlock is open.
    #[error("the laser's interlock is open")]
    InterlockOpen,
    /// The laser or its driver reports a fault.
    #[error("the laser reports a fault: {reason}")]
    Fault {
        /// The reported fault.
        reason: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// The controller that it shares with the stage has a fault.
    #[error("the laser reports a fault: {0}")]
    Controller(StageError),
    /// Its controller is still being reset or has not confirmed the last switching-off: it can be switched on soon.
    #[error("the laser cannot be switched on yet: {reason}")]
    NotYet {
        /// What it waits for.
        reason: &'static str,
    },
    /// A power that is not a fraction of full power.
    #[error("a laser cannot be set to power {value}")]
    BadPower {
        /// The requested value.
        value: f64,
    },
    /// The controller refused or does not respond; whether the laser is on is unknown until it is connected again.
    #[error("the laser cannot be reached: {reason}")]
    Disconnected {
        /// What was detected.
        reason: String,
    },
}

impl Remedy for LaserError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::InterlockOpen => "close all doors and covers",
            Self::NotYet { .. } => "try again in a moment",
            Self::BadPower { .. } => "give a power above 0 and at most 1",
            Self::Disconnected { .. } => "check cable and power, then reconnect",
            Self::Controller(error) => return error.remedy(),
            Self::Fault { remedy, .. } => remedy,
        }))
    }
}

/// A laser.
pub trait Laser: Send {
    /// Which laser this is.
    fn identity(&self) -> DeviceIdentity;

    /// Its capabilities.
    fn capabilities(&self) -> LaserCapabilities;

    /// What happens to the laser if this program is killed, as the second half of a sentence that begins "if this
    /// program is killed,".
    fn lost_host(&self) -> &'static str {
        "it is not known how long the laser stays on"
    }

    /// Switches the laser on with a fraction `power` of full power (0 < power ≤ 1) for at most `lease`, unless renewed.
    ///
    /// The lease runs in the driver, which turns the laser off also when the caller hangs. It is limited to
    /// [`crate::LASER_LEASE_LIMIT`]. Returns the accepted state.
    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError>;

    /// Extends the lease to `lease` from now; does not switch a laser on that is off.
    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError>;

    /// Switches the laser off. Works in every state and may be called any number of times.
    fn switch_off(&mut self) -> Result<(), LaserError>;

    /// Turns it off from another thread while a call is blocked; `None` if [`LaserCapabilities::switched`] is false.
    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>>;

    /// Its current state.
    fn poll(&mut self) -> Result<LaserState, LaserError>;

    /// Starts to reconnect the laser and returns at once; [`Laser::poll`] returns [`LaserError::Disconnected`] until it is
    /// connected. It is off afterwards.
    fn reconnect(&mut self) -> Result<(), LaserError>;
}
