//! The stage on the wire.

use app::events::by_kind;
use devices::{AcceptedMove, Homing, StageKind};
use serde::{Deserialize, Serialize};
use station::StationStatus;
use utoipa::ToSchema;

use crate::problem::{Problem, ProblemKind};
use crate::wire::hardware::devices::IdentityDto;

/// The stage.
#[derive(Debug, Serialize, ToSchema)]
pub struct StageDto {
    /// Whether the device is connected.
    pub connected: bool,
    /// Vendor, model and serial number.
    pub identity: IdentityDto,
    /// Whether it is linear or rotary; fields in the unit of the other kind are absent.
    pub kind: StageKindDto,
    /// Lowest and highest position of a linear stage.
    pub travel_mm: Option<[f64; 2]>,
    /// Lowest and highest angle of a rotary stage.
    pub travel_deg: Option<[f64; 2]>,
    /// Maximum speed of a linear stage.
    pub max_speed_mm_s: Option<f64>,
    /// Maximum speed of a rotary stage.
    pub max_speed_deg_s: Option<f64>,
    /// Resolution of a linear stage; 0 if unknown.
    pub resolution_mm: Option<f64>,
    /// Resolution of a rotary stage; 0 if unknown.
    pub resolution_deg: Option<f64>,
    /// Whether it cannot be commanded and its position is that of the latest frame, as for a recording, or a conveyor
    /// whose encoder triggers the camera: continuous scans then take the frames as they arrive, one resolution apart.
    pub follows_frames: bool,
    /// Travel of a conveyor from one trigger of its encoder to the next; absent for a stage that is commanded. Moves, jogs
    /// and homing of a conveyor are refused, and Stop does not stop it.
    pub frame_pitch_mm: Option<f64>,
    /// Whether it must be homed before it can move.
    pub needs_homing: bool,
    /// Whether it is homed.
    pub homed: bool,
    /// Position of a linear stage as read back; absent if unknown.
    pub position_mm: Option<f64>,
    /// Angle of a rotary stage as read back; absent if unknown.
    pub angle_deg: Option<f64>,
    /// Whether it is moving.
    pub moving: bool,
}

/// Kind of a stage.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StageKindDto {
    /// Moves along a line.
    Linear,
    /// Turns about an axis.
    Rotary,
}

/// Request to move the stage, in the unit of its kind.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "target_mm": 5.0 }))]
pub struct MoveDto {
    /// Target position of a linear stage.
    pub target_mm: Option<f64>,
    /// Target angle of a rotary stage.
    pub target_deg: Option<f64>,
    /// Maximum speed of a linear stage; default: that of the stage.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_mm_s: Option<f64>,
    /// Maximum speed of a rotary stage; default: that of the stage.
    #[schema(exclusive_minimum = 0.0)]
    pub speed_deg_s: Option<f64>,
}

/// Request to jog the stage, in the unit of its kind; the motion stops 300 ms after the last request.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "velocity_mm_s": 2.0 }))]
pub struct JogDto {
    /// Signed velocity of a linear stage; 0 stops.
    pub velocity_mm_s: Option<f64>,
    /// Signed velocity of a rotary stage; 0 stops.
    pub velocity_deg_s: Option<f64>,
}

/// An accepted motion; it continues after the response.
#[derive(Debug, Serialize, ToSchema)]
pub struct MotionDto {
    /// Target position of a linear stage, if the motion has one.
    pub target_mm: Option<f64>,
    /// Target angle of a rotary stage, if the motion has one.
    pub target_deg: Option<f64>,
    /// Speed of a linear stage, at most.
    pub speed_mm_s: Option<f64>,
    /// Speed of a rotary stage, at most.
    pub speed_deg_s: Option<f64>,
}

impl MotionDto {
    /// The motion that a stage of this kind accepted, if it moves.
    pub fn new(kind: StageKind, accepted: Option<AcceptedMove>) -> Self {
        let (target_mm, target_deg) = by_kind(kind, accepted.map(|to| to.target_mm));
        let (speed_mm_s, speed_deg_s) = by_kind(kind, accepted.map(|to| to.speed_mm_s));
        Self { target_mm, target_deg, speed_mm_s, speed_deg_s }
    }
}

/// The value in the unit of a stage of this kind, out of two fields: `(name, value)` in millimetres and in degrees.
///
/// # Errors
/// A value in the unit of the other kind of stage.
pub fn in_stage_unit(
    kind: StageKind,
    linear: (&str, Option<f64>),
    rotary: (&str, Option<f64>),
) -> Result<Option<f64>, Problem> {
    let (wanted, other, is) = match kind {
        StageKind::Linear => (linear, rotary, "linear"),
        StageKind::Rotary => (rotary, linear, "rotary"),
    };
    if other.1.is_some() {
        let detail = format!("{} is given, but the stage is {is}", other.0);
        let problem = Problem::new(ProblemKind::Impossible, detail).remedy(format!("give {} instead", wanted.0));
        return Err(problem.at(format!("/{}", other.0)));
    }
    Ok(wanted.1)
}

/// The same for a field that is required.
///
/// # Errors
/// A value in the unit of the other kind of stage, or none.
pub fn required_in_stage_unit(
    kind: StageKind,
    linear: (&str, Option<f64>),
    rotary: (&str, Option<f64>),
) -> Result<f64, Problem> {
    let name = if kind == StageKind::Rotary { rotary.0 } else { linear.0 };
    in_stage_unit(kind, linear, rotary)?.ok_or_else(|| {
        Problem::new(ProblemKind::Impossible, format!("{name} is missing"))
            .at(format!("/{name}"))
            .remedy(format!("give {name}"))
    })
}

impl From<&StationStatus> for StageDto {
    fn from(status: &StationStatus) -> Self {
        let can = &status.stage.capabilities;
        let (travel_mm, travel_deg) = by_kind(can.kind, Some([can.travel_mm.0, can.travel_mm.1]));
        let (max_speed_mm_s, max_speed_deg_s) = by_kind(can.kind, Some(can.max_speed_mm_s));
        let (resolution_mm, resolution_deg) = by_kind(can.kind, Some(can.resolution_mm));
        let (position_mm, angle_deg) = by_kind(can.kind, status.position_mm);
        Self {
            connected: status.stage.connected,
            identity: (&status.stage.identity).into(),
            travel_mm,
            travel_deg,
            max_speed_mm_s,
            max_speed_deg_s,
            resolution_mm,
            resolution_deg,
            kind: match can.kind {
                StageKind::Linear => StageKindDto::Linear,
                StageKind::Rotary => StageKindDto::Rotary,
            },
            follows_frames: can.follows_frames,
            frame_pitch_mm: can.frame_pitch_mm,
            needs_homing: can.homing == Homing::Required,
            homed: status.homed,
            position_mm,
            angle_deg,
            moving: status.moving,
        }
    }
}
