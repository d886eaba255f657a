//! A laser that this program does not switch: it is on as long as it has power.
//!
//! This is sufficient for scans. The guarantees that the laser is off (at start, at rest, after Stop, after a fault,
//! at exit) do not apply to such a laser, and this is stated wherever they are.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::drivers::laser_checks::check_power;
use crate::traits::driver::{DeviceSet, Driver, OpenError, Opened};
use crate::{DeviceIdentity, LASER_LEASE_LIMIT, Laser, LaserCapabilities, LaserError, LaserState, StopHandle};

/// Makes a laser that is always on: `[station.laser] kind = "none"`.
#[derive(Debug, Clone, Copy, Default)]
pub struct AlwaysOnDriver;

impl Driver for AlwaysOnDriver {
    fn kind(&self) -> &'static str {
        "none"
    }

    fn makes(&self) -> DeviceSet {
        DeviceSet { laser: true, ..DeviceSet::default() }
    }

    fn open(&self, wanted: DeviceSet) -> Result<Opened, OpenError> {
        let laser = wanted.laser.then(|| Box::new(AlwaysOnLaser::default()) as Box<dyn Laser>);
        Ok(Opened { laser, ..Opened::default() })
    }
}

/// See the module. Its state is the requested one, with leases like any laser's, so that callers need no special case;
/// `capabilities` states that it is not switched.
#[derive(Debug, Default)]
pub struct AlwaysOnLaser {
    requested_until: Option<Instant>,
}

impl AlwaysOnLaser {
    fn state(&mut self) -> LaserState {
        self.requested_until = self.requested_until.filter(|until| crate::time::now() < *until);
        let emitting = self.requested_until.is_some();
        LaserState { emitting, power: if emitting { 1.0 } else { 0.0 }, interlock_closed: None }
    }
}

impl Laser for AlwaysOnLaser {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity { model: "not controlled here".to_owned(), ..DeviceIdentity::unknown("none") }
    }

    fn capabilities(&self) -> LaserCapabilities {
        LaserCapabilities { switched: false, ..LaserCapabilities::default() }
    }

    fn lost_host(&self) -> &'static str {
        "the laser stays on: it is not controlled here"
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        check_power(power)?;
        self.requested_until = Some(crate::time::now() + lease.min(LASER_LEASE_LIMIT));
        Ok(self.state())
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        if self.state().emitting {
            self.requested_until = Some(crate::time::now() + lease.min(LASER_LEASE_LIMIT));
        }
        Ok(self.state())
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        self.requested_until = None;
        Ok(())
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        None
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        Ok(self.state())
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.switch_off()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::{self, LaserProfile};

    #[test]
    fn it_passes_the_suite_and_reports_that_it_is_not_switched() {
        let profile = LaserProfile { light: None, reaction_limit: Duration::from_millis(20), cable: None };
        contract::laser(&mut || Box::new(AlwaysOnLaser::default()), &profile);
        let laser = AlwaysOnLaser::default();
        assert!(!laser.capabilities().switched && laser.lost_host().contains("not controlled here"));
    }
}
