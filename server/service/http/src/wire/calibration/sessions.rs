//! Calibration sessions on the wire: requests and responses.

use optics::StagePosition;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::calibration::calibrations::{K3Dto, LightModelDto};
use crate::wire::calibration::projector::ProjectorDto;
use crate::wire::calibration::session_bodies::{ExposuresDto, SessionBodyDto, SessionNeedsDto};
use crate::wire::calibration::target::TargetDto;
use app::error::{AppError, ErrorKind};
use app::jobs::calibrate::SolveSession;
use app::sessions::{NewSession, Session, SessionDefaults, SessionNeeds, VirtualBoard};

/// A session with its version.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionDto {
    /// UUID v7.
    pub id: String,
    /// Version; increases with every change.
    pub version: i64,
    /// The content.
    pub body: SessionBodyDto,
    /// Requirements of a good calibration and how far they are met.
    pub needs: SessionNeedsDto,
    /// Time of creation, ms since 1970 (UTC).
    pub created_at_ms: i64,
    /// Time of the last change, ms since 1970 (UTC).
    pub changed_at_ms: i64,
}

impl From<Session> for SessionDto {
    fn from(session: Session) -> Self {
        let Session { id, version, body, created_at_ms, changed_at_ms } = session;
        let needs = SessionNeeds::of(&body).into();
        Self { id, version, body: body.into(), needs, created_at_ms, changed_at_ms }
    }
}

/// Request to create a session.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct NewSessionDto {
    /// Its name.
    pub name: Option<String>,
    /// The calibration board; default: the configured one.
    pub target: Option<TargetDto>,
    /// The line projector; default: the configured one.
    pub projector: Option<ProjectorDto>,
    /// Exposure settings.
    pub exposures: Option<ExposuresDto>,
}

impl From<NewSessionDto> for NewSession {
    fn from(dto: NewSessionDto) -> Self {
        let NewSessionDto { name, target, projector, exposures } = dto;
        Self {
            name,
            target: target.map(Into::into),
            projector: projector.map(Into::into),
            exposures: exposures.map(Into::into),
        }
    }
}

/// Defaults of a new session.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionDefaultsDto {
    /// The configured board.
    pub target: TargetDto,
    /// The configured line projector.
    pub projector: ProjectorDto,
    /// Exposure settings.
    pub exposures: ExposuresDto,
}

impl From<SessionDefaults> for SessionDefaultsDto {
    fn from(defaults: SessionDefaults) -> Self {
        let SessionDefaults { target, projector, exposures } = defaults;
        Self { target: target.into(), projector: projector.into(), exposures: exposures.into() }
    }
}

/// Stage position for the image; exactly one of the two.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CaptureStageViewDto {
    /// Position of a linear stage.
    #[schema(example = 5.0)]
    pub position_mm: Option<f64>,
    /// Angle of a turntable.
    pub angle_deg: Option<f64>,
}

impl TryFrom<CaptureStageViewDto> for StagePosition {
    type Error = AppError;

    fn try_from(dto: CaptureStageViewDto) -> Result<Self, AppError> {
        match (dto.position_mm, dto.angle_deg) {
            (Some(position_mm), None) => Ok(Self::LinearMm(position_mm)),
            (None, Some(angle_deg)) => Ok(Self::RotaryDeg(angle_deg)),
            _ => Err(AppError::new(ErrorKind::Impossible, "a stage view needs exactly one position")
                .at("/position_mm")
                .remedy("give position_mm, or angle_deg of a turntable")),
        }
    }
}

/// Options of the calibration job.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SolveSessionDto {
    /// Model of the light sheets; default `auto`.
    pub light_model: Option<LightModelDto>,
    /// Whether k3 is estimated; default `auto`.
    pub k3: Option<K3Dto>,
}

impl From<SolveSessionDto> for SolveSession {
    fn from(dto: SolveSessionDto) -> Self {
        let SolveSessionDto { light_model, k3 } = dto;
        let light_model = light_model.map(|model| model.code().to_owned());
        Self { light_model, k3: k3.map(|k3| k3.code().to_owned()), station: None }
    }
}

/// Where the virtual operator of the simulated station holds the board.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(tag = "place", rename_all = "snake_case", deny_unknown_fields)]
pub enum VirtualBoardDto {
    /// In one of the predefined poses.
    Pose {
        /// Index of the pose, from 0.
        pose: usize,
    },
    /// On the stage, for stage views.
    Stage,
    /// Removed; the previous scene returns to the stage.
    Away,
}

impl From<VirtualBoardDto> for VirtualBoard {
    fn from(dto: VirtualBoardDto) -> Self {
        match dto {
            VirtualBoardDto::Pose { pose } => Self::Pose { pose },
            VirtualBoardDto::Stage => Self::Stage,
            VirtualBoardDto::Away => Self::Away,
        }
    }
}
