//! Camera, stage and laser: the traits a station is built from, the drivers, and the contract suite that every driver
//! passes.
//!
//! The rules of all drivers (tested by `contract`):
//! - Moves are started and polled, never waited for, so that `stop` is always possible. No call takes longer than
//!   [`CALL_LIMIT`], except [`Camera::next_frame`], which takes at most the given time.
//! - Setters return what the device accepted. Missing features are values in its capabilities.
//! - A position or a stream that is not reliable is reported as unknown; after a fault the device is ready
//!   again, never active.
//! - A laser is leased: it goes off unless the lease is renewed.
//!
//! Which devices a station has, and what it does with them, do not belong here.

#[cfg(test)]
mod campaign;
pub mod contract;
mod drivers;
mod lines;
pub mod params;
mod simulators;
pub mod time;
mod traits;

pub use drivers::{always_on, conveyor, grbl, marlin, replay, stage_checks, threaded, zaber};
pub use lines::serial_line;
pub use simulators::{grbl_simulator, marlin_simulator, simulator, zaber_simulator};
pub use traits::{camera, driver, features, identity, laser, stage};

pub use drivers::threaded::ThreadedCamera;
pub use traits::camera::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, FrameInfo, PixelFormat, Roi, Trigger,
    ValueRange,
};
pub use traits::driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};
pub use traits::identity::DeviceIdentity;
pub use traits::laser::{Laser, LaserCapabilities, LaserError, LaserState};
pub use traits::stage::{AcceptedMove, Homing, Stage, StageCapabilities, StageError, StageKind, StageState};
pub use traits::stop_handle::StopHandle;

use std::time::Duration;

/// Longest time a driver may block its caller: a stop waits for at most one call.
pub const CALL_LIMIT: Duration = Duration::from_millis(20);

/// Longest lease of a laser; longer requests are cut to it. Light without a running owner ends within a second.
pub const LASER_LEASE_LIMIT: Duration = Duration::from_secs(1);
