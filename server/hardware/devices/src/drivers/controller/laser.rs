//! A laser: an output of a controller that moves a stage, too.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::StageDialogue;
use crate::drivers::laser_checks::check_power;
use crate::lines::serial_controller::Controller;
use crate::traits::stop_handle::StopHandle;
use crate::{DeviceIdentity, Laser, LaserCapabilities, LaserError, LaserState, ValueRange};

/// Smallest power that can be set; most drivers of diodes are dark below.
const MIN_POWER: f64 = 0.01;

/// A protocol's state as its laser asks it.
pub trait LaserDialogue: StageDialogue {
    /// See [`Laser::lost_host`].
    fn lost_host(&self) -> &'static str;
    /// Switches it on; the ticket of the line that does it.
    ///
    /// # Errors
    /// A fault that concerns the laser, or a stage that moves.
    fn switch_on(&mut self, power: f64, lease: Duration, now: Instant) -> Result<u64, LaserError>;
    /// Renews the lease.
    ///
    /// # Errors
    /// A fault that concerns the laser.
    fn renew(&mut self, lease: Duration, now: Instant) -> Result<(), LaserError>;
    /// Goes dark; the ticket of the line that does it.
    fn switch_off(&mut self, now: Instant) -> Option<u64>;
    /// What concerns a laser that is only asked: whether its state is known.
    ///
    /// # Errors
    /// The fault by which it is not.
    fn laser_known(&self) -> Result<(), LaserError>;
    /// The laser as far as it is known.
    fn laser_state(&self) -> LaserState;
    /// A refusal as the laser's caller is told it.
    fn laser_error(refusal: &Self::Fault) -> LaserError;
}

/// The laser of a controller. Dropping it darkens it.
///
/// The controller switches it at rest only: while the stage moves it is not switched on, and going dark (switched off, or
/// its lease ended) stops the move.
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
        self.0.ask(switch_on, D::laser_error)?;
        self.state()
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.0.act(|session, now| session.renew(lease, now))?;
        self.state()
    }

    /// Dark by `M5` within milliseconds at rest; while the stage moves, by stopping it.
    fn switch_off(&mut self) -> Result<(), LaserError> {
        let switch_off = |session: &mut D, now| {
            session.laser_known()?;
            Ok(((), session.switch_off(now)))
        };
        self.0.ask(switch_off, D::laser_error)
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
