//! The world shared by all devices of a station.

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

/// Random stream of the initial part on the stage, derived from a station's seed.
pub(super) const FIRST_PART_STREAM: u64 = 0x200;

/// Random stream of the dirt on the grating.
const DIRT_STREAM: u64 = 0x201;

/// Current state of the world.
pub(super) struct World {
    /// The station as created; faults change only what the renderer shows.
    pub model: Arc<StationModel>,
    pub renderer: Arc<Renderer>,
    pub scene: Arc<Scene>,
    pub stage: StageWorld,
    pub laser: LaserWorld,
    pub faults: Vec<TwinFault>,
    /// Distance between the triggers of a belt, if one carries the part.
    pub belt_pitch_mm: Option<f64>,
}

/// The sensor's view at the middle of an exposure.
#[derive(Clone)]
pub(super) struct View {
    pub renderer: Arc<Renderer>,
    pub scene: Arc<Scene>,
    pub position_mm: f64,
    pub laser_power: f64,
    pub stray_levels: f64,
    /// Size of the sensor's fixed pattern, grey levels of 255; 0 for a sensor without one.
    pub defect_levels: f64,
    /// Whether the lens is covered.
    pub covered: bool,
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
            belt_pitch_mm: None,
        })))
    }

    /// Locks the world; ignores poisoning by a panicked thread.
    pub(super) fn lock(&self) -> MutexGuard<'_, World> {
        self.0.lock()
    }
}

impl World {
    /// First value that `pick` returns for an active fault.
    pub(super) fn fault<T>(&self, pick: impl Fn(&TwinFault) -> Option<T>) -> Option<T> {
        self.faults.iter().find_map(pick)
    }

    pub(super) fn has(&self, fault: TwinFault) -> bool {
        self.faults.contains(&fault)
    }

    /// True position of the carriage.
    pub(super) fn true_position_mm(&self, at: Instant) -> f64 {
        self.stage.true_position_mm(self.stall_mm(), at)
    }

    /// Position of an obstacle.
    pub(super) fn stall_mm(&self) -> Option<f64> {
        self.fault(|fault| if let TwinFault::StageStall { at_mm } = *fault { Some(at_mm) } else { None })
    }

    pub(super) fn view(&self, at: Instant) -> View {
        let dirt = self
            .fault(|fault| if let TwinFault::DirtyGrating { fraction } = *fault { Some(fraction) } else { None });
        let defects =
            self.fault(|fault| if let TwinFault::SensorDefects { levels } = *fault { Some(levels) } else { None });
        View {
            renderer: self.renderer.clone(),
            scene: self.scene.clone(),
            position_mm: self.true_position_mm(at),
            laser_power: self.laser.light(at),
            stray_levels: dirt.unwrap_or(0.0) * STRAY_LEVELS,
            defect_levels: defects.unwrap_or(0.0),
            covered: self.has(TwinFault::LensCovered),
        }
    }

    /// The station as changed by its faults.
    pub(super) fn model_with_faults(&self) -> StationModel {
        faulty_model(&self.model, &self.faults)
    }
}

/// A station with wavelength drift and a dirty grating.
fn faulty_model(model: &StationModel, faults: &[TwinFault]) -> StationModel {
    let mut changed = model.clone();
    for fault in faults {
        match *fault {
            TwinFault::WavelengthDrift { relative } => changed.grating.wavelength_over_period *= 1.0 + relative,
            TwinFault::DirtyGrating { fraction } => {
                let dirt = derived_seed(model.seed, DIRT_STREAM);
                // The remaining grating profile still diffracts symmetrically to both sides.
                for (power, order) in changed.order_powers.iter_mut().zip(&model.orders) {
                    let unevenness = derived_seed(dirt, order.unsigned_abs().into()) as f64 / u64::MAX as f64;
                    *power *= 1.0 - fraction * (0.5 + 0.5 * unevenness);
                }
            }
            _ => {}
        }
    }
    changed
}
