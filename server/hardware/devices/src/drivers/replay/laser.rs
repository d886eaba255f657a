//! The laser of a replay: there is none, but the rules of leases apply.

use parking_lot::{Mutex, MutexGuard};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::drivers::laser_checks::check_power;
use crate::{
    DeviceIdentity, LASER_LEASE_LIMIT, Laser, LaserCapabilities, LaserError, LaserState, StopHandle, ValueRange,
};

/// Smallest power that can be set; it does not affect the recorded pictures.
const MIN_POWER: f64 = 0.01;

/// Implements the rules of leases without a laser.
pub struct ReplayLaser {
    name: String,
    lit: Arc<Mutex<Option<LaserLease>>>,
}

#[derive(Debug, Clone, Copy)]
struct LaserLease {
    power: f64,
    until: Instant,
}

impl StopHandle for Mutex<Option<LaserLease>> {
    fn stop_now(&self) {
        *lit(self) = None;
    }
}

fn lit(lit: &Mutex<Option<LaserLease>>) -> MutexGuard<'_, Option<LaserLease>> {
    lit.lock()
}

impl ReplayLaser {
    pub(super) fn new(name: String) -> Self {
        Self { name, lit: Arc::default() }
    }

    fn state(&self) -> LaserState {
        let mut lit = lit(&self.lit);
        *lit = lit.filter(|lit| Instant::now() < lit.until);
        LaserState { emitting: lit.is_some(), power: lit.map_or(0.0, |lit| lit.power), interlock_closed: None }
    }
}

impl Laser for ReplayLaser {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity { model: self.name.clone(), ..DeviceIdentity::unknown("replay") }
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
        let until = Instant::now() + lease.min(LASER_LEASE_LIMIT);
        *lit(&self.lit) = Some(LaserLease { power: power.max(MIN_POWER), until });
        Ok(self.state())
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.state();
        if let Some(lit) = &mut *lit(&self.lit) {
            lit.until = Instant::now() + lease.min(LASER_LEASE_LIMIT);
        }
        Ok(self.state())
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        *lit(&self.lit) = None;
        Ok(())
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        Some(self.lit.clone())
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        Ok(self.state())
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.switch_off()
    }
}
