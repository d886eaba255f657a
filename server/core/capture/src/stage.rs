//! `stage` of the manifest: the stage and its positions.

use serde::{Deserialize, Deserializer, Serialize};

/// The stage.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StageSheet {
    /// Its kind.
    #[serde(default)]
    pub kind: StageKind,
    /// rotary: one standard deviation of the stated angles, by data sheet or test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_sigma_deg: Option<f64>,
}

/// Kind of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StageKind {
    /// Linear; the default.
    #[default]
    Linear,
    /// About an axis: a turntable.
    Rotary,
}

/// A stage position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StagePlace {
    /// Nominal position of a linear stage.
    PositionMm(f64),
    /// Nominal angle of a turntable; not reduced to one turn.
    AngleDeg(f64),
}

impl StageSheet {
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl StageKind {
    /// Its name in the manifest.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Rotary => "rotary",
        }
    }

    /// A position of such a stage, from its value in mm or degrees.
    pub fn place(self, value: f64) -> StagePlace {
        match self {
            Self::Linear => StagePlace::PositionMm(value),
            Self::Rotary => StagePlace::AngleDeg(value),
        }
    }

    /// The key for positions of such a stage.
    pub fn key(self) -> &'static str {
        match self {
            Self::Linear => "position_mm",
            Self::Rotary => "angle_deg",
        }
    }
}

impl StagePlace {
    /// As values of position_mm and angle_deg.
    pub(crate) fn keys(self) -> (Option<f64>, Option<f64>) {
        match self {
            Self::PositionMm(position_mm) => (Some(position_mm), None),
            Self::AngleDeg(angle_deg) => (None, Some(angle_deg)),
        }
    }

    /// From the values of position_mm and angle_deg, exactly one of which is present.
    pub(crate) fn of_keys(position_mm: Option<f64>, angle_deg: Option<f64>) -> Self {
        match angle_deg {
            Some(angle_deg) => Self::AngleDeg(angle_deg),
            None => Self::PositionMm(position_mm.unwrap_or(f64::NAN)),
        }
    }

    /// The value, in mm or degrees.
    pub fn value(self) -> f64 {
        match self {
            Self::PositionMm(value) | Self::AngleDeg(value) => value,
        }
    }
}

impl std::fmt::Display for StagePlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::PositionMm(position_mm) => write!(f, "{position_mm:+.2} mm"),
            Self::AngleDeg(angle_deg) => write!(f, "{angle_deg:+.2}°"),
        }
    }
}

/// Reads a number that may be absent, but not null.
pub(crate) fn number<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    f64::deserialize(deserializer).map(Some)
}
