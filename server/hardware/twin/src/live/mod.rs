//! The simulated station in operation: camera, stage and laser behind the traits of `devices`, and one world they share.
//!
//! [`TwinStation`] is made from a [`StationModel`]; its devices go to whoever drives the station, its
//! [`TwinControl`] is its virtual operator: parts and boards are put on the stage, faults switched on and off, the truth
//! read. The camera renders in a thread of its own, as a sensor exposes by itself.
//! Light, noise and timing: `server/docs/maths/twin.md`.

mod camera;
mod control;
mod fault;
mod following;
mod laser;
mod motion;
mod options;
mod params;
mod sensor_thread;
mod stage;
mod world;

pub use camera::TwinCamera;
pub use control::TwinControl;
pub use fault::{FaultNameError, TwinFault};
pub use laser::TwinLaser;
pub use options::{Timing, TwinOptions};
pub use params::{BOARD_EXPOSURE_US, LASER_EXPOSURE_US};
pub use stage::TwinStage;

use devices::{Laser, Stage};

use crate::live::following::Mirror;
use crate::live::world::SharedWorld;
use crate::model::station::StationModel;

/// A simulated station, switched on.
pub struct TwinStation {
    world: SharedWorld,
    options: TwinOptions,
    mirror: Mirror,
}

impl TwinStation {
    /// Switches a station on. A ball lies on its stage, as [`TwinOptions::scene`] says.
    pub fn new(model: StationModel, options: TwinOptions) -> Self {
        Self { world: SharedWorld::new(&model, &options), options, mirror: Mirror::default() }
    }

    /// The virtual operator.
    pub fn control(&self) -> TwinControl {
        TwinControl::new(self.world.clone())
    }

    /// Opens the devices: at rest, dark, stopped. Opened again they share the same world.
    pub fn devices(&self) -> (TwinCamera, TwinStage, TwinLaser) {
        (self.camera(), self.stage(), self.laser())
    }

    /// Opens the camera.
    pub fn camera(&self) -> TwinCamera {
        TwinCamera::open(self.world.clone(), &self.options)
    }

    /// Opens the stage: at rest; homed only where it needs no homing.
    pub fn stage(&self) -> TwinStage {
        TwinStage::open(self.world.clone(), &self.options)
    }

    /// Opens the laser: dark.
    pub fn laser(&self) -> TwinLaser {
        TwinLaser::open(self.world.clone())
    }
    /// A stage of another driver, which the carriage of this world follows from now on.
    pub fn followed_stage(&self, stage: Box<dyn Stage>) -> Box<dyn Stage> {
        self.mirror.stage(stage, &self.control())
    }

    /// A laser of another driver, which the light of this world follows from now on.
    pub fn followed_laser(&self, laser: Box<dyn Laser>) -> Box<dyn Laser> {
        self.mirror.laser(laser, &self.control())
    }
}
