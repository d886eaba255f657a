//! Linear and rotary stages: each moves the part by one rigid motion per frame.

mod linear;
mod motion;
mod nodes;
mod rotary;
mod uncertainty;

use crate::frames::{CameraFrame, PartFrame, PointMm};

pub use linear::{StageAxis, Straightness, Tilt};
pub use motion::Motion;
pub use nodes::MAX_STAGE_NODES;
pub use rotary::{ANGLE_NODES, AngleError, RotaryAxis};
pub use uncertainty::{FrameUncertainty, StageUncertainty};

/// Kind of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StageKind {
    /// Linear.
    Linear,
    /// Rotary: a turntable.
    Rotary,
}

/// A stage position, as stated by the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StagePosition {
    /// Travel of a linear stage, mm.
    LinearMm(f64),
    /// Angle of a turntable, degrees; not reduced to one turn.
    RotaryDeg(f64),
}

/// A one-σ step of a stage's deviation at one of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NodeMode {
    /// Step of the stage's parameters; empty if they stay.
    pub(crate) of_parameters: Vec<f64>,
    /// Step of the values at all nodes.
    pub(crate) at_nodes: Vec<f64>,
}

/// A calibrated stage.
#[expect(clippy::large_enum_variant, reason = "a handful exist at a time, and no collection holds them")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stage {
    /// A linear stage.
    Linear(StageAxis),
    /// A turntable.
    Rotary(RotaryAxis),
}

impl StageKind {
    /// Its name in the capture format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Rotary => "rotary",
        }
    }

    /// A position of such a stage, from its value in the stage's unit.
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
    /// Its kind of stage.
    pub fn kind(self) -> StageKind {
        match self {
            Self::LinearMm(_) => StageKind::Linear,
            Self::RotaryDeg(_) => StageKind::Rotary,
        }
    }

    /// The value, in the unit of its kind.
    pub fn value(self) -> f64 {
        match self {
            Self::LinearMm(value) | Self::RotaryDeg(value) => value,
        }
    }

    /// Travel; `None` for a turntable.
    pub fn mm(self) -> Option<f64> {
        match self {
            Self::LinearMm(position_mm) => Some(position_mm),
            Self::RotaryDeg(_) => None,
        }
    }

    /// Angle; `None` for a linear stage.
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
    /// Its kind.
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

    /// The motion of the part at `position`; `None` if that is a position of another kind of stage.
    pub fn motion(&self, position: StagePosition) -> Option<Motion> {
        match (self, position) {
            (Self::Linear(axis), StagePosition::LinearMm(position_mm)) => Some(axis.motion(position_mm)),
            (Self::Rotary(axis), StagePosition::RotaryDeg(angle_deg)) => Some(axis.motion(angle_deg.to_radians())),
            _ => None,
        }
    }

    /// A point in the camera frame at `position`, in the part frame; `None` if that is a position of another kind of
    /// stage.
    pub fn part_from_camera(
        &self,
        hit_in_camera: &PointMm<CameraFrame>,
        position: StagePosition,
    ) -> Option<PointMm<PartFrame>> {
        Some(self.motion(position)?.part_from_camera(hit_in_camera))
    }

    /// Number of parameters estimated by a calibration.
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

    /// Independent one-σ steps of the deviations at its nodes; empty if they are unknown.
    pub(crate) fn node_modes(&self) -> Vec<NodeMode> {
        match self {
            Self::Linear(axis) => axis.node_modes(),
            Self::Rotary(axis) => axis.node_modes(),
        }
    }

    /// Moved by a step of its parameters, then of the deviations at its nodes.
    pub(crate) fn stepped(&self, step: &[f64]) -> Self {
        let (parameter_step, deviation_step) = step.split_at(self.parameters());
        match self {
            Self::Linear(axis) => Self::Linear(axis.stepped(parameter_step, deviation_step)),
            Self::Rotary(axis) => Self::Rotary(axis.stepped(parameter_step, deviation_step)),
        }
    }
}
