//! A laser that is an output of a controller which may also move a stage.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::StageDialogue;
use crate::drivers::laser_checks::check_power;
use crate::lines::serial_controller::Controller;
use crate::traits::stop_handle::StopHandle;
use crate::{DeviceIdentity, Laser, LaserCapabilities, LaserError, LaserState, ValueRange};

/// Smallest power that can be set; most laser diode drivers emit nothing below it.
const MIN_POWER: f64 = 0.01;

/// The laser's interface to the state of a protocol.
pub trait LaserDialogue: StageDialogue {
    /// See [`Laser::lost_host`].
    fn lost_host(&self) -> &'static str;
    /// Switches it on; returns the ticket of the line that does so.
    ///
    /// # Errors
    /// A fault that concerns the laser, or a moving stage.
    fn switch_on(&mut self, power: f64, lease: Duration, now: Instant) -> Result<u64, LaserError>;
    /// Renews the lease.
    ///
    /// # Errors
    /// A fault that concerns the laser.
    fn renew(&mut self, lease: Duration, now: Instant) -> Result<(), LaserError>;
    /// Switches it off; returns the ticket of the line that does so.
    fn switch_off(&mut self, now: Instant) -> Option<u64>;
    /// Checks that the laser's state is known.
    ///
    /// # Errors
    /// The fault because of which it is not.
    fn laser_known(&self) -> Result<(), LaserError>;
    /// The laser's last known state.
    fn laser_state(&self) -> LaserState;
    /// Converts a refusal to the laser's error.
    fn laser_error(refusal: &Self::Fault) -> LaserError;
}

/// The laser of a controller. Dropping it switches it off.
///
/// The controller switches it at rest only: while the stage moves it is not switched on, and switching it off (by
/// command, or at the end of its lease) stops the move.
pub struct ControllerLaser<D: LaserDialogue>(Arc<Controller<D>>);

impl<D: LaserDialogue> ControllerLaser<D> {
    pub(in crate::drivers) fn new(controller: &Arc<Controller<D>>) -> Self {
        Self(Arc::clone(controller))
    }

    fn state(&self) -> Result<LaserState, LaserError> {
        self.0.act(|session, _| session.laser_known().map(|()| session.laser_state()))
    }
}

impl<D: LaserDialogue> Laser for ControllerLaser<D> {
    fn identity(&self) -> DeviceIdentity {
        self.0.act(|session, _| session.identity())
    }

    fn capabilities(&self) -> LaserCapabilities {
        LaserCapabilities { power: Some(ValueRange { min: MIN_POWER, max: 1.0 }), ..LaserCapabilities::default() }
    }

    fn lost_host(&self) -> &'static str {
        self.0.act(|session, _| session.lost_host())
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        check_power(power)?;
        let power = power.max(MIN_POWER);
        let switch_on =
            |session: &mut D, now| session.switch_on(power, lease, now).map(|ticket| ((), Some(ticket)));
        self.0.request(switch_on, D::laser_error)?;
        self.state()
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.0.act(|session, now| session.renew(lease, now))?;
        self.state()
    }

    /// Off by `M5` within milliseconds at rest; while the stage moves, by stopping it.
    fn switch_off(&mut self) -> Result<(), LaserError> {
        let switch_off = |session: &mut D, now| {
            session.laser_known()?;
            Ok(((), session.switch_off(now)))
        };
        self.0.request(switch_off, D::laser_error)
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        Some(self.0.clone())
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.state()
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.0.act(|session, now| session.reconnect(now));
        Ok(())
    }
}

impl<D: LaserDialogue> Drop for ControllerLaser<D> {
    fn drop(&mut self) {
        self.switch_off().ok();
    }
}
