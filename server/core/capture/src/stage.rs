//! `stage` of the manifest: the stage and its positions.

use serde::{Deserialize, Deserializer, Serialize};

/// The stage.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StageDescription {
    /// Its kind.
    #[serde(default)]
    pub kind: StageKind,
    /// Standard deviation of the stated angles of a rotary stage, from its data sheet or a test.
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
    /// Rotary: a turntable.
    Rotary,
}

/// A nominal stage position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NominalPosition {
    /// Nominal position of a linear stage.
    PositionMm(f64),
    /// Nominal angle of a turntable; not reduced to one turn.
    AngleDeg(f64),
}

impl StageDescription {
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
    pub fn position(self, value: f64) -> NominalPosition {
        match self {
            Self::Linear => NominalPosition::PositionMm(value),
            Self::Rotary => NominalPosition::AngleDeg(value),
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

impl NominalPosition {
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

impl std::fmt::Display for NominalPosition {
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
