//! The stage on the wire.

use devices::{Homing, StageKind};
use serde::{Deserialize, Serialize};
use station::StationStatus;
use utoipa::ToSchema;

use crate::wire::hardware::devices::IdentityDto;

/// The stage.
#[derive(Debug, Serialize, ToSchema)]
pub struct StageDto {
    /// Whether it answers.
    pub connected: bool,
    /// Which one.
    pub identity: IdentityDto,
    /// Lowest and highest position.
    pub travel_mm: [f64; 2],
    /// Fastest move.
    pub max_speed_mm_s: f64,
    /// The smallest step; 0 if unknown.
    pub resolution_mm: f64,
    /// How it moves the part. Positions and speeds of a rotary stage are degrees and °/s.
    pub kind: StageKindDto,
    /// Whether nobody commands it and it is where the frame last delivered was taken, as that of a recording or a
    /// conveyor whose encoder triggers the camera: continuous scans then take the frames that come, `resolution_mm`
    /// apart.
    pub follows_frames: bool,
    /// Whether it must be homed before it moves.
    pub needs_homing: bool,
    /// Whether its zero is established.
    pub homed: bool,
    /// Position as read back; missing if unknown.
    pub position_mm: Option<f64>,
    /// Whether it moves.
    pub moving: bool,
}

/// How a stage moves the part.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StageKindDto {
    /// Along a line.
    Linear,
    /// About an axis.
    Rotary,
}

/// Where to.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MoveDto {
    /// Position.
    #[schema(example = 5.0)]
    pub target_mm: f64,
    /// At most so fast; missing: as fast as the stage can.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_s: Option<f64>,
}

/// Move while this is repeated; it stops 300 ms after the last one.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct JogDto {
    /// Signed speed; 0 stops.
    #[schema(example = 2.0)]
    pub velocity_mm_s: f64,
}

/// A motion as accepted; it goes on.
#[derive(Debug, Serialize, ToSchema)]
pub struct MotionDto {
    /// Where it goes, if that is fixed.
    pub target_mm: Option<f64>,
    /// How fast, at most.
    pub speed_mm_s: Option<f64>,
}

impl From<&StationStatus> for StageDto {
    fn from(status: &StationStatus) -> Self {
        let can = &status.stage.capabilities;
        Self {
            connected: status.stage.connected,
            identity: (&status.stage.identity).into(),
            travel_mm: [can.travel_mm.0, can.travel_mm.1],
            max_speed_mm_s: can.max_speed_mm_s,
            resolution_mm: can.resolution_mm,
            kind: match can.kind {
                StageKind::Linear => StageKindDto::Linear,
                StageKind::Rotary => StageKindDto::Rotary,
            },
            follows_frames: can.follows_frames,
            needs_homing: can.homing == Homing::Required,
            homed: status.homed,
            position_mm: status.position_mm,
            moving: status.moving,
        }
    }
}
