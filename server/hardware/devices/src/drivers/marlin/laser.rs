//! The laser: the cutter output of a controller built with `LASER_FEATURE`.

use std::sync::Arc;
use std::time::Duration;

use super::session::Session;
use crate::drivers::laser_checks::check_power;
use crate::lines::serial_controller::Controller;
use crate::{DeviceIdentity, Laser, LaserCapabilities, LaserError, LaserState, StageError, ValueRange};

/// Smallest power that can be set; most drivers of diodes are dark below.
const MIN_POWER: f64 = 0.01;

/// The laser of a Marlin controller. Dropping it darkens it.
///
/// `M3` and `M5` wait for the end of the motion: while the stage moves the laser is not switched on, and going dark
/// (switched off, or its lease ended) stops the move.
pub struct MarlinLaser {
    controller: Arc<Controller<Session>>,
}

impl MarlinLaser {
    pub(super) fn new(controller: &Arc<Controller<Session>>) -> Self {
        Self { controller: Arc::clone(controller) }
    }

    fn state(&self) -> Result<LaserState, LaserError> {
        self.controller.act(|session, _| session.laser_known().map(|()| session.laser_state()))
    }
}

impl Laser for MarlinLaser {
    fn identity(&self) -> DeviceIdentity {
        self.controller.act(|session, _| identity_of(session))
    }

    fn capabilities(&self) -> LaserCapabilities {
        LaserCapabilities { power: Some(ValueRange { min: MIN_POWER, max: 1.0 }), ..LaserCapabilities::default() }
    }

    /// The firmware does not say how it was built.
    fn lost_host(&self) -> &'static str {
        "the laser goes off a second after the last motion (LASER_SAFETY_TIMEOUT_MS as delivered); firmware built \
         without that timeout leaves it on until it is reset"
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        check_power(power)?;
        let power = power.max(MIN_POWER);
        let switch_on =
            |session: &mut Session, now| session.switch_on(power, lease, now).map(|ticket| ((), Some(ticket)));
        self.controller.ask(switch_on, refused)?;
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
        self.controller.ask(switch_off, refused)
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.state()
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.controller.act(|session, now| session.reconnect(now));
        Ok(())
    }
}

impl Drop for MarlinLaser {
    fn drop(&mut self) {
        self.switch_off().ok();
    }
}

fn refused(fault: &StageError) -> LaserError {
    LaserError::Controller(fault.clone())
}

/// What the controller said about itself.
pub(super) fn identity_of(session: &Session) -> DeviceIdentity {
    let unknown = || DeviceIdentity {
        driver: "marlin",
        vendor: String::new(),
        model: String::new(),
        serial: String::new(),
        firmware: String::new(),
    };
    session.machine().map_or_else(unknown, |machine| machine.identity.clone())
}
