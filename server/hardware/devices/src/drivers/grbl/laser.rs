//! The laser: the spindle output of a controller in laser mode.

use std::sync::Arc;
use std::time::Duration;

use super::fault::Fault;
use super::session::Session;
use crate::drivers::laser_checks::check_power;
use crate::lines::serial_controller::Controller;
use crate::{DeviceIdentity, Laser, LaserCapabilities, LaserError, LaserState, ValueRange};

/// Smallest power that can be set; most drivers of diodes are dark below.
const MIN_POWER: f64 = 0.01;

/// What is said of a controller that was never reached.
const UNKNOWN_END: &str = "the laser may stay on: its controller was not reached";

/// The laser of a GRBL controller. Dropping it darkens it.
///
/// The controller switches the laser only at rest: while the stage moves it is not switched on, and going dark
/// (switched off, or its lease ended) stops the move.
pub struct GrblLaser {
    controller: Arc<Controller<Session>>,
}

impl GrblLaser {
    pub(super) fn new(controller: &Arc<Controller<Session>>) -> Self {
        Self { controller: Arc::clone(controller) }
    }

    fn state(&self) -> Result<LaserState, LaserError> {
        self.controller.act(|session, _| session.laser_known().map(|()| session.laser_state()))
    }
}

impl Laser for GrblLaser {
    fn identity(&self) -> DeviceIdentity {
        self.controller.act(|session, _| identity_of(session))
    }

    fn capabilities(&self) -> LaserCapabilities {
        LaserCapabilities { power: Some(ValueRange { min: MIN_POWER, max: 1.0 }), ..LaserCapabilities::default() }
    }

    fn lost_host(&self) -> &'static str {
        self.controller.act(|session, _| session.machine().map_or(UNKNOWN_END, |machine| machine.lost_host))
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        check_power(power)?;
        let power = power.max(MIN_POWER);
        let switch_on =
            |session: &mut Session, now| session.switch_on(power, lease, now).map(|ticket| ((), Some(ticket)));
        self.controller.ask(switch_on, Fault::for_laser)?;
        self.state()
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.controller.act(|session, now| session.renew(lease, now))?;
        self.state()
    }

    /// Dark by `M5` within milliseconds at rest; while the stage moves, by stopping it.
    fn switch_off(&mut self) -> Result<(), LaserError> {
        let switch_off = |session: &mut Session, now| {
            session.laser_known()?;
            Ok(((), session.switch_off(now)))
        };
        self.controller.ask(switch_off, Fault::for_laser)
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.state()
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.controller.act(|session, now| session.reconnect(now));
        Ok(())
    }
}

impl Drop for GrblLaser {
    fn drop(&mut self) {
        self.switch_off().ok();
    }
}

/// What the controller said about itself.
pub(super) fn identity_of(session: &Session) -> DeviceIdentity {
    let unknown = || DeviceIdentity {
        driver: "grbl",
        vendor: String::new(),
        model: String::new(),
        serial: String::new(),
        firmware: String::new(),
    };
    session.machine().map_or_else(unknown, |machine| machine.identity.clone())
}
