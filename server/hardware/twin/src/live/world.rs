//! The one world that all devices of a station share.

use parking_lot::{Mutex, MutexGuard};
use std::sync::Arc;
use std::time::Instant;

use crate::live::fault::TwinFault;
use crate::live::laser::LaserWorld;
use crate::live::options::TwinOptions;
use crate::live::params::STRAY_LEVELS;
use crate::live::stage::StageWorld;
use crate::model::random::derived_seed;
use crate::model::station::StationModel;
use crate::part::scene::Scene;
use crate::render::renderer::Renderer;

/// Stream of the part that lies on the stage at first, among those derived from a station's seed.
pub(super) const FIRST_PART_STREAM: u64 = 0x200;

/// Stream of the dirt on the grating.
const DIRT_STREAM: u64 = 0x201;

/// The state of the world at this moment.
pub(super) struct World {
    /// The station as it was made; faults change what the renderer shows, not this.
    pub model: Arc<StationModel>,
    pub renderer: Arc<Renderer>,
    pub scene: Arc<Scene>,
    pub stage: StageWorld,
    pub laser: LaserWorld,
    pub faults: Vec<TwinFault>,
}

/// What the sensor sees at the middle of an exposure.
#[derive(Clone)]
pub(super) struct View {
    pub renderer: Arc<Renderer>,
    pub scene: Arc<Scene>,
    pub position_mm: f64,
    pub laser_power: f64,
    pub stray_levels: f64,
}

/// Shared access to the world.
#[derive(Clone)]
pub(super) struct SharedWorld(Arc<Mutex<World>>);

impl SharedWorld {
    pub(super) fn new(model: &StationModel, options: &TwinOptions) -> Self {
        let now = Instant::now();
        Self(Arc::new(Mutex::new(World {
            renderer: Arc::new(Renderer::new(model)),
            scene: Arc::new(options.scene.placed(model, FIRST_PART_STREAM)),
            model: Arc::new(model.clone()),
            stage: StageWorld::new(options, now),
            laser: LaserWorld::new(now),
            faults: Vec::new(),
        })))
    }

    /// The world, for a moment; a thread that panicked with it leaves it as it was.
    pub(super) fn lock(&self) -> MutexGuard<'_, World> {
        self.0.lock()
    }
}

impl World {
    /// The fault for which `pick` gives something.
    pub(super) fn fault<T>(&self, pick: impl Fn(&TwinFault) -> Option<T>) -> Option<T> {
        self.faults.iter().find_map(pick)
    }

    pub(super) fn has(&self, fault: TwinFault) -> bool {
        self.faults.contains(&fault)
    }

    /// Where the carriage truly is.
    pub(super) fn true_position_mm(&self, at: Instant) -> f64 {
        self.stage.true_position_mm(self.stall_mm(), at)
    }

    /// Where an obstacle stands.
    pub(super) fn stall_mm(&self) -> Option<f64> {
        self.fault(|fault| if let TwinFault::StageStall { at_mm } = *fault { Some(at_mm) } else { None })
    }

    pub(super) fn view(&self, at: Instant) -> View {
        let dirt =
            self.fault(|fault| if let TwinFault::DirtyGrating { share } = *fault { Some(share) } else { None });
        View {
            renderer: self.renderer.clone(),
            scene: self.scene.clone(),
            position_mm: self.true_position_mm(at),
            laser_power: self.laser.light(at),
            stray_levels: dirt.unwrap_or(0.0) * STRAY_LEVELS,
        }
    }

    /// The station as its faults have changed it.
    pub(super) fn model_with_faults(&self) -> StationModel {
        faulty_model(&self.model, &self.faults)
    }
}

/// A station that has warmed up, and whose grating is dirty.
fn faulty_model(model: &StationModel, faults: &[TwinFault]) -> StationModel {
    let mut changed = model.clone();
    for fault in faults {
        match *fault {
            TwinFault::WavelengthDrift { relative } => changed.grating.wavelength_over_period *= 1.0 + relative,
            TwinFault::DirtyGrating { share } => {
                let dirt = derived_seed(model.seed, DIRT_STREAM);
                for (idx, power) in changed.order_powers.iter_mut().enumerate() {
                    let unevenness = derived_seed(dirt, idx as u64) as f64 / u64::MAX as f64;
                    *power *= 1.0 - share * (0.5 + 0.5 * unevenness);
                }
            }
            _ => {}
        }
    }
    changed
}
