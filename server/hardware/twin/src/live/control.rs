//! Control of the simulation: what an operator does at a real station, and access to the truth.

use std::sync::Arc;
use std::time::Instant;

use crate::live::fault::TwinFault;
use crate::live::world::{FIRST_PART_STREAM, SharedWorld};
use crate::model::station::StationModel;
use crate::part::mesh::Solid;
use crate::part::scene::{Scene, SceneKind};
use crate::render::renderer::Renderer;

/// The virtual operator: puts parts on the stage, sets faults, reads the truth. Cheap to clone.
#[derive(Clone)]
pub struct TwinControl {
    world: SharedWorld,
}

impl TwinControl {
    pub(super) fn new(world: SharedWorld) -> Self {
        Self { world }
    }

    /// Puts a scene on the stage in place of what was there.
    pub fn place(&self, scene: Scene) {
        self.world.lock().scene = Arc::new(scene);
    }

    /// Puts a part on the stage: a little aslant, always in the same way.
    pub fn place_part(&self, part: &SceneKind) {
        let model = self.model();
        self.place(part.placed(&model, FIRST_PART_STREAM));
    }

    /// Puts a solid on the stage's plate: a little aslant, as [`TwinControl::place_part`] does.
    pub fn place_solid(&self, solid: Arc<Solid>) {
        let model = self.model();
        self.place(Scene::mesh(solid, &model, FIRST_PART_STREAM));
    }

    /// What is on the stage.
    pub fn scene(&self) -> Arc<Scene> {
        self.world.lock().scene.clone()
    }

    /// The true station, as it was made.
    pub fn model(&self) -> Arc<StationModel> {
        self.world.lock().model.clone()
    }

    /// The renderer of the station's pictures and truth points, faults of laser and grating included.
    pub fn renderer(&self) -> Arc<Renderer> {
        self.world.lock().renderer.clone()
    }

    /// Switches a fault on; one of the same kind is replaced.
    pub fn set_fault(&self, fault: TwinFault) {
        let mut world = self.world.lock();
        world.faults.retain(|other| other.name() != fault.name());
        world.faults.push(fault);
        let now = Instant::now();
        world.stage_fault_begins(fault, now);
        world.laser_fault_begins(fault, now);
        drop(world);
        self.follow_drift(fault);
    }

    /// Switches the fault of that name off; returns whether it was on.
    pub fn clear_fault(&self, name: &str) -> bool {
        let mut world = self.world.lock();
        let Some(idx) = world.faults.iter().position(|fault| fault.name() == name) else { return false };
        let fault = world.faults.remove(idx);
        world.stage_fault_ends(fault);
        drop(world);
        self.follow_drift(fault);
        true
    }

    /// The faults that are on.
    pub fn faults(&self) -> Vec<TwinFault> {
        self.world.lock().faults.clone()
    }

    /// Where the carriage truly is.
    pub fn true_position_mm(&self) -> f64 {
        self.world.lock().true_position_mm(Instant::now())
    }

    /// Share of full power that the laser really emits.
    pub fn laser_power(&self) -> f64 {
        self.world.lock().laser.light(Instant::now())
    }

    /// Lets the carriage be where `position_mm` says, for a station whose stage is not the twin's own.
    pub fn follow_stage(&self, position_mm: impl Fn(Instant) -> f64 + Send + Sync + 'static) {
        self.world.lock().stage.follows = Some(Arc::new(position_mm));
    }

    /// Sets the laser to the share of full power that `power` returns, for a station whose laser is not the
    /// twin's own.
    pub fn follow_laser(&self, power: impl Fn(Instant) -> f64 + Send + Sync + 'static) {
        self.world.lock().laser.follows = Some(Arc::new(power));
    }

    /// Lets the pictures show what laser and grating have become; computed here, off the sensor's thread.
    fn follow_drift(&self, fault: TwinFault) {
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
