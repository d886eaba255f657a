//! The laser of a replay: there is none, but the rules of leases apply.

use parking_lot::{Mutex, MutexGuard};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::drivers::laser_checks::check_power;
use crate::{
    DeviceIdentity, LASER_LEASE_LIMIT, Laser, LaserCapabilities, LaserError, LaserState, StopHandle, ValueRange,
};

/// Smallest power that can be set; it does not affect the recorded images.
const MIN_POWER: f64 = 0.01;

/// Implements the rules of leases without a laser.
pub struct ReplayLaser {
    name: String,
    active: Arc<Mutex<Option<LaserLease>>>,
}

#[derive(Debug, Clone, Copy)]
struct LaserLease {
    power: f64,
    until: Instant,
}

impl StopHandle for Mutex<Option<LaserLease>> {
    fn stop_now(&self) {
        *active(self) = None;
    }
}

fn active(active: &Mutex<Option<LaserLease>>) -> MutexGuard<'_, Option<LaserLease>> {
    active.lock()
}

impl ReplayLaser {
    pub(super) fn new(name: String) -> Self {
        Self { name, active: Arc::default() }
    }

    fn state(&self) -> LaserState {
        let mut active = active(&self.active);
        *active = active.filter(|active| Instant::now() < active.until);
        LaserState {
            emitting: active.is_some(),
            power: active.map_or(0.0, |active| active.power),
            interlock_closed: None,
        }
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
        "there is no laser: its light is recorded in the images"
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        check_power(power)?;
        let until = Instant::now() + lease.min(LASER_LEASE_LIMIT);
        *active(&self.active) = Some(LaserLease { power: power.max(MIN_POWER), until });
        Ok(self.state())
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.state();
        if let Some(active) = &mut *active(&self.active) {
            active.until = Instant::now() + lease.min(LASER_LEASE_LIMIT);
        }
        Ok(self.state())
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        *active(&self.active) = None;
        Ok(())
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        Some(self.active.clone())
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        Ok(self.state())
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        self.switch_off()
    }
}
