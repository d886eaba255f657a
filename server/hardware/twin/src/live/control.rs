//! Control of the simulation: the actions of an operator, and access to the ground truth.

use std::sync::Arc;
use std::time::Instant;

use crate::live::fault::TwinFault;
#[cfg(doc)]
use crate::live::params::BELT_START_MM;
use crate::live::world::{FIRST_PART_STREAM, SharedWorld};
use crate::model::station::StationModel;
use crate::part::mesh::Solid;
use crate::part::scene::{Scene, SceneKind};
use crate::render::renderer::Renderer;

/// Control of the simulation: places parts on the stage, injects faults, reads the ground truth. Cheap to clone.
#[derive(Clone)]
pub struct TwinControl {
    world: SharedWorld,
}

impl TwinControl {
    pub(super) fn new(world: SharedWorld) -> Self {
        Self { world }
    }

    /// Replaces the scene on the stage.
    pub fn place(&self, scene: Scene) {
        self.world.lock().scene = Arc::new(scene);
    }

    /// Places a part on the stage, slightly tilted, always in the same way.
    pub fn place_part(&self, part: &SceneKind) {
        let model = self.model();
        self.place(part.placed(&model, FIRST_PART_STREAM));
    }

    /// Places a solid on the stage's plate, tilted as by [`TwinControl::place_part`].
    pub fn place_solid(&self, solid: Arc<Solid>) {
        let model = self.model();
        self.place(Scene::mesh(solid, &model, FIRST_PART_STREAM));
    }

    /// The scene on the stage.
    pub fn scene(&self) -> Arc<Scene> {
        self.world.lock().scene.clone()
    }

    /// The true station, as created.
    pub fn model(&self) -> Arc<StationModel> {
        self.world.lock().model.clone()
    }

    /// The renderer of the station's images and truth points, including faults of laser and grating.
    pub fn renderer(&self) -> Arc<Renderer> {
        self.world.lock().renderer.clone()
    }

    /// Switches a fault on; it replaces one of the same kind.
    pub fn set_fault(&self, fault: TwinFault) {
        let mut world = self.world.lock();
        world.faults.retain(|other| other.name() != fault.name());
        world.faults.push(fault);
        let now = Instant::now();
        world.start_stage_fault(fault, now);
        world.start_laser_fault(fault, now);
        drop(world);
        self.update_renderer_for_drift(fault);
    }

    /// Switches the fault of that name off; returns whether it was on.
    pub fn clear_fault(&self, name: &str) -> bool {
        let mut world = self.world.lock();
        let Some(idx) = world.faults.iter().position(|fault| fault.name() == name) else { return false };
        let fault = world.faults.remove(idx);
        world.end_stage_fault(fault);
        drop(world);
        self.update_renderer_for_drift(fault);
        true
    }

    /// The active faults.
    pub fn faults(&self) -> Vec<TwinFault> {
        self.world.lock().faults.clone()
    }

    /// True position of the carriage.
    pub fn true_position_mm(&self) -> f64 {
        self.world.lock().true_position_mm(Instant::now())
    }

    /// Emitted fraction of full power.
    pub fn laser_power(&self) -> f64 {
        self.world.lock().laser.light(Instant::now())
    }

    /// Makes the carriage follow `position_mm`, for a station whose stage is not the twin's own.
    pub fn follow_stage(&self, position_mm: impl Fn(Instant) -> f64 + Send + Sync + 'static) {
        self.world.lock().stage.follows = Some(Arc::new(position_mm));
    }

    /// Puts a belt under the camera whose encoder triggers it every `pitch_mm`, at the camera's frame rate. With each
    /// acquisition the scene passes again, from [`BELT_START_MM`] on.
    pub fn run_belt(&self, pitch_mm: f64) {
        self.world.lock().belt_pitch_mm = Some(pitch_mm);
    }

    /// Makes the laser follow `power`, a fraction of full power, for a station whose laser is not the twin's own.
    pub fn follow_laser(&self, power: impl Fn(Instant) -> f64 + Send + Sync + 'static) {
        self.world.lock().laser.follows = Some(Arc::new(power));
    }

    /// Updates the renderer for the drift of laser and grating; computed here, not on the sensor's thread.
    fn update_renderer_for_drift(&self, fault: TwinFault) {
        if !matches!(fault, TwinFault::WavelengthDrift { .. } | TwinFault::DirtyGrating { .. }) {
            return;
        }
        loop {
            let (renderer, model) = {
                let world = self.world.lock();
                (world.renderer.clone(), world.model_with_faults())
            };
            let changed = Arc::new(renderer.with_light_of(&model));
            let mut world = self.world.lock();
            if world.model_with_faults() == model {
                world.renderer = changed;
                return;
            }
        }
    }
}
