//! The stage in a capture's manifest.

use capture::{NominalPosition, StageKind};
use optics::StagePosition;

/// The stage kind in the manifest.
pub fn capture_stage(kind: optics::StageKind) -> StageKind {
    match kind {
        optics::StageKind::Linear => StageKind::Linear,
        optics::StageKind::Rotary => StageKind::Rotary,
    }
}

/// The position in the manifest.
pub fn nominal_position(position: StagePosition) -> NominalPosition {
    match position {
        StagePosition::LinearMm(position_mm) => NominalPosition::PositionMm(position_mm),
        StagePosition::RotaryDeg(angle_deg) => NominalPosition::AngleDeg(angle_deg),
    }
}
