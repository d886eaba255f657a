//! The contract suite that every camera, stage and laser passes: the simulated station, a replay, and real devices.
//!
//! Every rule is a function that opens a new device and panics with a message that states the rule. [`camera()`],
//! [`stage()`] and [`laser()`] run all of them. Rules about features that the profile does not declare (holding a move,
//! unplugging the cable) are skipped.

mod calls;
mod camera;
mod laser;
mod stage;
mod stopwatch;

pub use camera::{CameraProfile, camera, camera_faults};
pub use laser::{LaserProfile, laser, laser_faults};
pub use stage::{StageProfile, stage, stage_faults, uncommanded_stage};
pub use stopwatch::Stopwatch;

/// Unplugs a device's cable, and plugs it in again.
pub struct Cable {
    /// Disconnects the device.
    pub unplug: Box<dyn Fn()>,
    /// Connects it again, so that `reconnect` succeeds.
    pub replug: Box<dyn Fn()>,
}
