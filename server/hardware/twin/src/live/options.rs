//! How a simulated station is to behave.

use optics::StageKind;

use crate::part::scene::SceneKind;

/// Whether things take their time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Timing {
    /// Moves without a stated speed arrive at once, exposures take no time, nothing rings.
    #[default]
    Instant,
    /// Speeds, ramps, ringing, homing, exposure and read-out take the time they take on a bench.
    Realistic,
}

/// How a simulated station is to behave.
#[derive(Debug, Clone, PartialEq)]
pub struct TwinOptions {
    /// Whether things take their time.
    pub timing: Timing,
    /// What lies on the stage when the station is switched on.
    pub scene: SceneKind,
    /// Travel of the stage, mm; of a turntable, degrees.
    pub travel_mm: (f64, f64),
    /// Whether the stage must be homed before it moves; with [`Timing::Realistic`] it must in any case.
    pub homing_required: bool,
}

impl TwinOptions {
    /// As by default, with the travel of such a stage: a turntable's is more than a whole turn both ways.
    pub fn of(kind: StageKind) -> Self {
        match kind {
            StageKind::Linear => Self::default(),
            StageKind::Rotary => Self { travel_mm: (-400.0, 400.0), ..Self::default() },
        }
    }
}

impl Default for TwinOptions {
    /// A ball of radius 18.9 mm on a stage of ±100 mm, without waiting.
    fn default() -> Self {
        Self {
            timing: Timing::Instant,
            scene: SceneKind::Sphere { radius_mm: 18.9 },
            travel_mm: (-100.0, 100.0),
            homing_required: false,
        }
    }
}
