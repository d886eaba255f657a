//! The stage: what it does to the part is one rigid motion per frame, whether it travels or turns.

mod linear;
mod motion;
mod rotary;
mod spread;

use crate::frames::{CameraFrame, PartFrame, PointMm};

pub use linear::{MAX_STRAIGHTNESS_NODES, StageAxis, Straightness};
pub use motion::Motion;
pub use rotary::{ANGLE_NODES, AngleError, RotaryAxis};
pub use spread::{FrameSpread, StageSpread};

/// How a stage moves the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StageKind {
    /// Along a line.
    Linear,
    /// About an axis.
    Rotary,
}

/// Where a stage stood, by its own count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StagePosition {
    /// Travel of a linear stage, mm.
    LinearMm(f64),
    /// Angle of a turntable, degrees; more than one turn counts on.
    RotaryDeg(f64),
}

/// A calibrated stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stage {
    /// It travels.
    Linear(StageAxis),
    /// It turns.
    Rotary(RotaryAxis),
}

impl StageKind {
    /// The word of the capture format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Rotary => "rotary",
        }
    }

    /// A position of such a stage, from its number in the stage's unit.
    pub fn position(self, value: f64) -> StagePosition {
        match self {
            Self::Linear => StagePosition::LinearMm(value),
            Self::Rotary => StagePosition::RotaryDeg(value),
        }
    }

    /// The unit of its positions.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Linear => "mm",
            Self::Rotary => "°",
        }
    }
}

impl StagePosition {
    /// Of which kind of stage.
    pub fn kind(self) -> StageKind {
        match self {
            Self::LinearMm(_) => StageKind::Linear,
            Self::RotaryDeg(_) => StageKind::Rotary,
        }
    }

    /// The number alone, in the unit of its kind.
    pub fn value(self) -> f64 {
        match self {
            Self::LinearMm(value) | Self::RotaryDeg(value) => value,
        }
    }

    /// Travel; `None` of a turntable.
    pub fn mm(self) -> Option<f64> {
        match self {
            Self::LinearMm(position_mm) => Some(position_mm),
            Self::RotaryDeg(_) => None,
        }
    }

    /// Angle; `None` of a linear stage.
    pub fn deg(self) -> Option<f64> {
        match self {
            Self::LinearMm(_) => None,
            Self::RotaryDeg(angle_deg) => Some(angle_deg),
        }
    }
}

impl std::fmt::Display for StagePosition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::LinearMm(position_mm) => write!(f, "{position_mm} mm"),
            Self::RotaryDeg(angle_deg) => write!(f, "{angle_deg}°"),
        }
    }
}

impl From<StageAxis> for Stage {
    fn from(axis: StageAxis) -> Self {
        Self::Linear(axis)
    }
}

impl From<RotaryAxis> for Stage {
    fn from(axis: RotaryAxis) -> Self {
        Self::Rotary(axis)
    }
}

impl Stage {
    /// Whether it travels or turns.
    pub fn kind(&self) -> StageKind {
        match self {
            Self::Linear(_) => StageKind::Linear,
            Self::Rotary(_) => StageKind::Rotary,
        }
    }

    /// The travel of a linear stage.
    pub fn linear(&self) -> Option<StageAxis> {
        match self {
            Self::Linear(axis) => Some(*axis),
            Self::Rotary(_) => None,
        }
    }

    /// The axis of a turntable.
    pub fn rotary(&self) -> Option<RotaryAxis> {
        match self {
            Self::Linear(_) => None,
            Self::Rotary(axis) => Some(*axis),
        }
    }

    /// What the stage has done to the part at `position`; `None` if that is a position of the other kind of stage.
    pub fn motion(&self, position: StagePosition) -> Option<Motion> {
        match (self, position) {
            (Self::Linear(axis), StagePosition::LinearMm(position_mm)) => Some(axis.motion(position_mm)),
            (Self::Rotary(axis), StagePosition::RotaryDeg(angle_deg)) => Some(axis.motion(angle_deg.to_radians())),
            _ => None,
        }
    }

    /// A point seen by the camera at `position`, fixed to the part; `None` if that is a position of the other kind of stage.
    pub fn part_from_camera(
        &self,
        hit_in_camera: &PointMm<CameraFrame>,
        position: StagePosition,
    ) -> Option<PointMm<PartFrame>> {
        Some(self.motion(position)?.part_from_camera(hit_in_camera))
    }

    /// How many parameters of it a calibration estimates.
    pub fn parameters(&self) -> usize {
        match self {
            Self::Linear(_) => 3,
            Self::Rotary(_) => 4,
        }
    }

    /// Names of these parameters.
    pub fn parameter_names(&self) -> &'static [&'static str] {
        match self {
            Self::Linear(_) => &["stage_x", "stage_y", "stage_z"],
            Self::Rotary(_) => &["axis_tilt_1", "axis_tilt_2", "axis_shift_1", "axis_shift_2"],
        }
    }

    /// Moved by a step of its parameters, then of the deviations that its straightness or its angle allows.
    pub(crate) fn stepped(&self, step: &[f64]) -> Self {
        let (of_parameters, of_deviations) = step.split_at(self.parameters());
        match self {
            Self::Linear(axis) => Self::Linear(axis.stepped(of_parameters, of_deviations)),
            Self::Rotary(axis) => Self::Rotary(axis.stepped(of_parameters, of_deviations)),
        }
    }
}
