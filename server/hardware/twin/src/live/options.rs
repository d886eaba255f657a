//! Options of a simulated station.

use optics::StageKind;

use crate::part::scene::SceneKind;

/// Whether processes take realistic time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Timing {
    /// Moves without a stated speed are immediate, exposures take no time, nothing rings.
    #[default]
    Instant,
    /// Speeds, ramps, ringing, homing, exposure and read-out take as long as on a real station.
    Realistic,
}

/// Options of a simulated station.
#[derive(Debug, Clone, PartialEq)]
pub struct TwinOptions {
    /// Timing.
    pub timing: Timing,
    /// Scene on the stage when the station is switched on.
    pub scene: SceneKind,
    /// Travel of the stage, mm; of a turntable, degrees.
    pub travel_mm: (f64, f64),
    /// Whether the stage must be homed before it moves; always with [`Timing::Realistic`].
    pub homing_required: bool,
}

impl TwinOptions {
    /// Default options with the travel of such a stage; a turntable turns more than one revolution in each direction.
    pub fn of(kind: StageKind) -> Self {
        match kind {
            StageKind::Linear => Self::default(),
            StageKind::Rotary => Self { travel_mm: (-400.0, 400.0), ..Self::default() },
        }
    }
}

impl Default for TwinOptions {
    /// A ball of radius 18.9 mm on a stage of ±100 mm, without delays.
    fn default() -> Self {
        Self {
            timing: Timing::Instant,
            scene: SceneKind::Sphere { radius_mm: 18.9 },
            travel_mm: (-100.0, 100.0),
            homing_required: false,
        }
    }
}
