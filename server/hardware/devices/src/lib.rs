//! Camera, stage and laser: the traits a station is built from, the drivers, and the suite that every driver passes.
//!
//! The rules all drivers keep (`contract` tests them):
//! - Moves are started and polled, never waited for, so that `stop` is always within reach. No call takes longer
//!   than [`CALL_LIMIT`], except [`Camera::next_frame`], which takes at most the time it is given.
//! - Setters return what the device accepted. What a device cannot do is a value in its capabilities.
//! - A position or a stream that cannot be trusted is said to be unknown; the device comes back ready, never active.
//! - A laser is a lease: it goes dark by itself when nobody renews it.

pub mod camera;
pub mod driver;
pub mod features;
pub mod identity;
pub mod laser;
pub mod stage;

pub mod always_on;
pub mod contract;
pub mod grbl;
pub mod grbl_simulator;
pub mod marlin;
pub mod marlin_simulator;
pub mod params;
pub mod replay;
pub mod serial_line;
pub mod simulator;
pub mod threaded;
pub mod time;
pub mod zaber;
pub mod zaber_simulator;

#[cfg(test)]
mod campaign;
mod laser_checks;
mod line_reader;
mod memory_line;
mod ports;
mod serial_controller;
mod stage_checks;
mod tcp_line;

pub use camera::{
    Camera, CameraCapabilities, CameraError, CameraRequest, CameraSettings, FrameInfo, PixelFormat, Roi, Trigger,
    ValueRange,
};
pub use driver::{DeviceSet, Driver, Found, MissingSetting, OpenError, Opened};
pub use identity::DeviceIdentity;
pub use laser::{Laser, LaserCapabilities, LaserError, LaserState};
pub use stage::{AcceptedMove, Homing, Stage, StageCapabilities, StageError, StageKind, StageState};
pub use threaded::ThreadedCamera;

use std::time::Duration;

/// Longest time a driver may keep its caller: a stop waits behind at most one call.
pub const CALL_LIMIT: Duration = Duration::from_millis(20);

/// Longest lease a laser grants; what is asked beyond it is cut to it. Light without a living owner ends in a second.
pub const LASER_LEASE_LIMIT: Duration = Duration::from_secs(1);
