//! Camera, stage and laser: the traits a station is built from, the drivers, and the suite that every driver passes.
//!
//! The rules all drivers keep (`contract` tests them):
//! - Moves are started and polled, never waited for, so that `stop` is always within reach. No call takes longer
//!   than [`CALL_LIMIT`], except [`Camera::next_frame`], which takes at most the time it is given.
//! - Setters return what the device accepted. What a device cannot do is a value in its capabilities.
//! - A position or a stream that cannot be trusted is said to be unknown; the device comes back ready, never active.
//! - A laser is a lease: it goes dark by itself when nobody renews it.

#[cfg(test)]
mod campaign;
pub mod contract;
mod drivers;
mod lines;
pub mod params;
mod simulators;
pub mod time;
mod traits;

pub use drivers::{always_on, grbl, marlin, replay, threaded, zaber};
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

/// Longest time a driver may keep its caller: a stop waits behind at most one call.
pub const CALL_LIMIT: Duration = Duration::from_millis(20);

/// Longest lease a laser grants; what is asked beyond it is cut to it. Light without a living owner ends in a second.
pub const LASER_LEASE_LIMIT: Duration = Duration::from_secs(1);
