//! The simulated station in operation: camera, stage and laser behind the traits of `devices`, and the world they
//! fraction.
//!
//! [`TwinStation`] is created from a [`StationModel`]. Its devices are used like real ones; its [`TwinControl`] is the
//! simulation's control, which places parts and boards on the stage, switches faults on and off, and reads the ground
//! truth. The camera renders on its own thread, as a sensor exposes independently. Light, noise and timing:
//! `server/docs/maths/twin.md`.

mod camera;
mod control;
mod fault;
mod following;
mod laser;
mod motion;
mod options;
mod params;
mod sensor_defects;
mod sensor_thread;
mod stage;
mod world;

pub use camera::TwinCamera;
pub use control::TwinControl;
pub use fault::{FaultNameError, TwinFault};
pub use laser::TwinLaser;
pub use options::{Timing, TwinOptions};
pub use params::{BELT_START_MM, BOARD_EXPOSURE_US, LASER_EXPOSURE_US};
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
    /// Switches a station on, with the scene of [`TwinOptions::scene`].
    pub fn new(model: StationModel, options: TwinOptions) -> Self {
        Self { world: SharedWorld::new(&model, &options), options, mirror: Mirror::default() }
    }

    /// Control of the simulation.
    pub fn control(&self) -> TwinControl {
        TwinControl::new(self.world.clone())
    }

    /// Opens the devices: stage at rest, laser off, camera stopped. Devices opened again share the same world.
    pub fn devices(&self) -> (TwinCamera, TwinStage, TwinLaser) {
        (self.camera(), self.stage(), self.laser())
    }

    /// Opens the camera.
    pub fn camera(&self) -> TwinCamera {
        TwinCamera::open(self.world.clone(), &self.options)
    }

    /// Opens the stage: at rest; homed only if it needs no homing.
    pub fn stage(&self) -> TwinStage {
        TwinStage::open(self.world.clone(), &self.options)
    }

    /// Opens the laser: off.
    pub fn laser(&self) -> TwinLaser {
        TwinLaser::open(self.world.clone())
    }
    /// Makes the carriage of this world follow another driver's stage.
    pub fn followed_stage(&self, stage: Box<dyn Stage>) -> Box<dyn Stage> {
        self.mirror.stage(stage, &self.control())
    }

    /// Makes the light of this world follow another driver's laser.
    pub fn followed_laser(&self, laser: Box<dyn Laser>) -> Box<dyn Laser> {
        self.mirror.laser(laser, &self.control())
    }
}
