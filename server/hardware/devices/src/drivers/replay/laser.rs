//! The laser of a replay: there is none, but the rules of a lease hold.

use std::time::{Duration, Instant};

use crate::drivers::laser_checks::check_power;
use crate::{DeviceIdentity, LASER_LEASE_LIMIT, Laser, LaserCapabilities, LaserError, LaserState, ValueRange};

/// Smallest power that can be set; the recording's light does not change with it.
const MIN_POWER: f64 = 0.01;

/// Keeps the rules of a lease without any light.
pub struct ReplayLaser {
    name: String,
    lit: Option<Lit>,
}

#[derive(Debug, Clone, Copy)]
struct Lit {
    power: f64,
    until: Instant,
}

impl ReplayLaser {
    pub(super) fn new(name: String) -> Self {
        Self { name, lit: None }
    }

    fn state(&mut self) -> LaserState {
        self.lit = self.lit.filter(|lit| Instant::now() < lit.until);
        LaserState {
            emitting: self.lit.is_some(),
            power: self.lit.map_or(0.0, |lit| lit.power),
            interlock_closed: None,
        }
    }
}

impl Laser for ReplayLaser {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            driver: "replay",
            vendor: String::new(),
            model: self.name.clone(),
            serial: String::new(),
            firmware: String::new(),
        }
    }

    fn capabilities(&self) -> LaserCapabilities {
        LaserCapabilities {
            switched: true,
            power: Some(ValueRange { min: MIN_POWER, max: 1.0 }),
            interlock: false,
        }
    }

    fn lost_host(&self) -> &'static str {
        "there is no laser: it is recorded"
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        check_power(power)?;
        self.lit = Some(Lit { power: power.max(MIN_POWER), until: Instant::now() + lease.min(LASER_LEASE_LIMIT) });
        Ok(self.state())
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.state();
        if let Some(lit) = &mut self.lit {
            lit.until = Instant::now() + lease.min(LASER_LEASE_LIMIT);
        }
        Ok(self.state())
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        self.lit = None;
        Ok(())
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        Ok(self.state())
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.switch_off()
    }
}
