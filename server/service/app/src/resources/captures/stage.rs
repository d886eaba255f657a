//! The stage in a capture's manifest.

use capture::{StageKind, StagePlace};
use optics::StagePosition;

/// The stage kind in the manifest.
pub fn capture_stage(kind: optics::StageKind) -> StageKind {
    match kind {
        optics::StageKind::Linear => StageKind::Linear,
        optics::StageKind::Rotary => StageKind::Rotary,
    }
}

/// The position in the manifest.
pub fn capture_place(position: StagePosition) -> StagePlace {
    match position {
        StagePosition::LinearMm(position_mm) => StagePlace::PositionMm(position_mm),
        StagePosition::RotaryDeg(angle_deg) => StagePlace::AngleDeg(angle_deg),
    }
}
