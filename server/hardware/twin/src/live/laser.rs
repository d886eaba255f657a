//! The simulated laser: on only under a lease, with an interlock and a fault line.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{DeviceIdentity, LASER_LEASE_LIMIT, Laser, LaserCapabilities, LaserError, LaserState, StopHandle};

use crate::live::fault::TwinFault;
use crate::live::params::LASER_POWER;
use crate::live::world::{SharedWorld, World};

/// Power of an external laser, as a fraction of full power.
pub(super) type PowerSource = Arc<dyn Fn(Instant) -> f64 + Send + Sync>;

/// A fault detected by the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum DetectedFault {
    Fault,
    Disconnected,
}

/// State of the laser.
pub(super) struct LaserWorld {
    power: f64,
    until: Instant,
    detected_fault: Option<DetectedFault>,
    pub follows: Option<PowerSource>,
}

impl LaserWorld {
    pub(super) fn new(now: Instant) -> Self {
        Self { power: 0.0, until: now, detected_fault: None, follows: None }
    }

    /// Emitted power at a time, as a fraction of full power.
    pub(super) fn light(&self, at: Instant) -> f64 {
        match &self.follows {
            Some(source) => source(at),
            None if at < self.until => self.power,
            None => 0.0,
        }
    }

    fn turn_off(&mut self, now: Instant) {
        (self.power, self.until) = (0.0, now);
    }

    fn error(&self) -> Option<LaserError> {
        match self.detected_fault? {
            DetectedFault::Fault => Some(LaserError::Fault {
                reason: "the laser driver is overheated".to_owned(),
                remedy: "let it cool down, then reset the station",
            }),
            DetectedFault::Disconnected => {
                Some(LaserError::Disconnected { reason: "its cable was unplugged".to_owned() })
            }
        }
    }
}

impl World {
    /// Starts a fault of the laser; each of them turns it off.
    pub(super) fn start_laser_fault(&mut self, fault: TwinFault, now: Instant) {
        match fault {
            TwinFault::LaserFault => self.laser.detected_fault = Some(DetectedFault::Fault),
            TwinFault::LaserUnplugged => self.laser.detected_fault = Some(DetectedFault::Disconnected),
            TwinFault::InterlockOpen => {}
            _ => return,
        }
        self.laser.turn_off(now);
    }

    fn laser_state(&self, now: Instant) -> LaserState {
        let power = self.laser.light(now);
        let interlock_closed = Some(!self.has(TwinFault::InterlockOpen));
        LaserState { emitting: power > 0.0, power, interlock_closed }
    }
}

/// The laser of a [`crate::live::TwinStation`].
pub struct TwinLaser {
    world: SharedWorld,
}

impl TwinLaser {
    pub(super) fn open(world: SharedWorld) -> Self {
        let now = Instant::now();
        let mut guard = world.lock();
        guard.laser = LaserWorld { follows: guard.laser.follows.take(), ..LaserWorld::new(now) };
        for fault in [TwinFault::LaserFault, TwinFault::LaserUnplugged] {
            if guard.has(fault) {
                guard.start_laser_fault(fault, now);
            }
        }
        drop(guard);
        Self { world }
    }

    fn with_laser<T>(
        &self,
        act: impl FnOnce(&mut World, Instant) -> Result<T, LaserError>,
    ) -> Result<T, LaserError> {
        let mut world = self.world.lock();
        match world.laser.error() {
            Some(error) => Err(error),
            None => act(&mut world, Instant::now()),
        }
    }
}

impl Laser for TwinLaser {
    fn identity(&self) -> DeviceIdentity {
        DeviceIdentity {
            driver: "twin",
            vendor: "Sheaf".to_owned(),
            model: "simulated laser".to_owned(),
            serial: self.world.lock().model.seed.to_string(),
            firmware: String::new(),
        }
    }

    fn capabilities(&self) -> LaserCapabilities {
        LaserCapabilities { switched: true, power: Some(LASER_POWER), interlock: true }
    }

    fn lost_host(&self) -> &'static str {
        "the simulated laser goes off"
    }

    fn switch_on(&mut self, power: f64, lease: Duration) -> Result<LaserState, LaserError> {
        if !(power > 0.0 && power <= 1.0) {
            return Err(LaserError::BadPower { value: power });
        }
        self.with_laser(|world, now| {
            if world.has(TwinFault::InterlockOpen) {
                return Err(LaserError::InterlockOpen);
            }
            world.laser.power = LASER_POWER.clamp(power);
            world.laser.until = now + lease.min(LASER_LEASE_LIMIT);
            Ok(world.laser_state(now))
        })
    }

    fn renew(&mut self, lease: Duration) -> Result<LaserState, LaserError> {
        self.with_laser(|world, now| {
            if world.laser.light(now) > 0.0 {
                world.laser.until = now + lease.min(LASER_LEASE_LIMIT);
            }
            Ok(world.laser_state(now))
        })
    }

    fn switch_off(&mut self) -> Result<(), LaserError> {
        let mut world = self.world.lock();
        world.laser.turn_off(Instant::now());
        match world.laser.detected_fault {
            Some(DetectedFault::Disconnected) => world.laser.error().map_or(Ok(()), Err),
            _ => Ok(()),
        }
    }

    fn stop_handle(&self) -> Option<Arc<dyn StopHandle>> {
        Some(Arc::new(LaserStop(self.world.clone())))
    }

    fn poll(&mut self) -> Result<LaserState, LaserError> {
        self.with_laser(|world, now| Ok(world.laser_state(now)))
    }

    fn reconnect(&mut self) -> Result<(), LaserError> {
        let mut world = self.world.lock();
        if !(world.has(TwinFault::LaserFault) || world.has(TwinFault::LaserUnplugged)) {
            world.laser.detected_fault = None;
        }
        world.laser.turn_off(Instant::now());
        Ok(())
    }
}

/// Turns the laser off, independently of its owner.
struct LaserStop(SharedWorld);

impl StopHandle for LaserStop {
    fn stop_now(&self) {
        self.0.lock().laser.turn_off(Instant::now());
    }
}

impl Drop for TwinLaser {
    fn drop(&mut self) {
        self.world.lock().laser.turn_off(Instant::now());
    }
}
