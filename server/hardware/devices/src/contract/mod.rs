//! The suite that every camera, stage and laser passes: the simulated station, a replay, and real devices.
//!
//! Every rule is a function of its own that opens a fresh device and panics with a sentence that names the rule.
//! [`camera()`], [`stage()`] and [`laser()`] run all of them. What a device cannot do (hold a move, lose its cable on
//! request) is said by its profile, and the rules about it are skipped.

mod calls;
mod camera;
mod laser;
mod stage;
mod stopwatch;

pub use camera::{CameraProfile, camera, camera_faults};
pub use laser::{LaserProfile, laser, laser_faults};
pub use stage::{StageProfile, stage, stage_faults};
pub use stopwatch::Stopwatch;

/// Pulls a device's cable, and puts it in again.
pub struct Cable {
    /// Takes the device away.
    pub unplug: Box<dyn Fn()>,
    /// Brings it back, so that `reconnect` can reach it.
    pub replug: Box<dyn Fn()>,
}
