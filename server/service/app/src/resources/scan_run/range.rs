//! The rows of a scan along the stage motion: millimetres of travel, or degrees of rotation.

use optics::{StageKind, StagePosition};
use serde::{Deserialize, Serialize};
use station::StationStatus;

/// Range and row spacing in the unit of [`ScanRange::stage`]: mm, or degrees for a turntable.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "StoredRange", into = "StoredRange")]
pub struct ScanRange {
    /// The kind of stage, which determines the unit.
    pub stage: StageKind,
    /// Position of the first row.
    pub from: f64,
    /// Position of the last row at most, linear stage.
    pub to: f64,
    /// Distance between rows, always positive.
    pub step: f64,
    /// Speed during a continuous scan, per second.
    pub speed: Option<f64>,
}

/// The stored form, with the unit in every key.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum StoredRange {
    Linear { from_mm: f64, to_mm: f64, step_mm: f64, speed_mm_s: Option<f64> },
    Rotary { from_deg: f64, to_deg: f64, step_deg: f64, speed_deg_s: Option<f64> },
}

impl ScanRange {
    /// Position of a row, rounded to the nanometre or microdegree.
    pub fn position(&self, row: usize) -> StagePosition {
        let at = self.from + self.direction() * self.step * row as f64;
        self.stage.position((at * 1e6).round() / 1e6)
    }

    /// +1 or −1.
    pub fn direction(&self) -> f64 {
        if self.to < self.from { -1.0 } else { 1.0 }
    }

    /// Length of the range.
    pub fn length(&self) -> f64 {
        (self.to - self.from).abs()
    }

    /// A length with its unit.
    pub fn amount(&self, way: f64) -> StagePosition {
        self.stage.position(way)
    }
}

/// The kind of the station's stage.
pub fn stage_kind(status: &StationStatus) -> StageKind {
    match status.stage.capabilities.kind {
        devices::StageKind::Linear => StageKind::Linear,
        devices::StageKind::Rotary => StageKind::Rotary,
    }
}

impl From<StoredRange> for ScanRange {
    fn from(stored: StoredRange) -> Self {
        match stored {
            StoredRange::Linear { from_mm: from, to_mm: to, step_mm: step, speed_mm_s: speed } => {
                Self { stage: StageKind::Linear, from, to, step, speed }
            }
            StoredRange::Rotary { from_deg: from, to_deg: to, step_deg: step, speed_deg_s: speed } => {
                Self { stage: StageKind::Rotary, from, to, step, speed }
            }
        }
    }
}

impl From<ScanRange> for StoredRange {
    fn from(range: ScanRange) -> Self {
        let ScanRange { stage, from, to, step, speed } = range;
        match stage {
            StageKind::Linear => Self::Linear { from_mm: from, to_mm: to, step_mm: step, speed_mm_s: speed },
            StageKind::Rotary => Self::Rotary { from_deg: from, to_deg: to, step_deg: step, speed_deg_s: speed },
        }
    }
}
