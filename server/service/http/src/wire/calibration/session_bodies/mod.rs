//! The content of a calibration session on the wire.

mod images;
mod needs;

use app::sessions::SessionBody;
use app::sessions::image_capture::Exposures;

use crate::wire::calibration::projector::ProjectorDto;
use crate::wire::calibration::target::TargetDto;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use images::{SessionPoseDto, SessionStageViewDto};
pub use needs::{BoardDetectionDto, CameraEstimateDto, SessionNeedsDto};

/// The content of a calibration session.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionBodyDto {
    /// Its name.
    pub name: String,
    /// The calibration board.
    pub target: TargetDto,
    /// Nominal values of the line projector.
    pub projector: ProjectorDto,
    /// Exposure settings.
    pub exposures: ExposuresDto,
    /// Image width; 0 before the first image.
    pub width_px: usize,
    /// Image height; 0 before the first image.
    pub height_px: usize,
    /// Captured poses of the board.
    pub poses: Vec<SessionPoseDto>,
    /// The board on the stage, at several positions.
    pub stage_views: Vec<SessionStageViewDto>,
    /// Camera estimate from the boards so far.
    pub camera: CameraEstimateDto,
    /// The calibration job started from this session.
    pub job_id: Option<String>,
}

/// Exposure times and laser power.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct ExposuresDto {
    /// Exposure time for the board, laser off.
    pub board_exposure_us: f64,
    /// Exposure time for the laser lines.
    pub laser_exposure_us: f64,
    /// Fraction of full laser power, above 0 and at most 1.
    pub laser_power: f64,
    /// Ambient light, in levels of 255, above which the laser lines are exposed with the laser off as well, to be
    /// subtracted; without it never.
    pub background_above_levels: Option<f64>,
}

impl From<SessionBody> for SessionBodyDto {
    fn from(of: SessionBody) -> Self {
        let SessionBody {
            name,
            target,
            projector,
            exposures,
            width_px,
            height_px,
            poses,
            stage_views,
            camera,
            job_id,
        } = of;
        Self {
            name,
            target: target.into(),
            projector: projector.into(),
            exposures: exposures.into(),
            width_px,
            height_px,
            poses: poses.into_iter().map(Into::into).collect(),
            stage_views: stage_views.into_iter().map(Into::into).collect(),
            camera: camera.into(),
            job_id,
        }
    }
}

impl From<Exposures> for ExposuresDto {
    fn from(of: Exposures) -> Self {
        let Exposures { board_exposure_us, laser_exposure_us, laser_power, background_above_levels } = of;
        Self { board_exposure_us, laser_exposure_us, laser_power, background_above_levels }
    }
}

impl From<ExposuresDto> for Exposures {
    fn from(of: ExposuresDto) -> Self {
        let ExposuresDto { board_exposure_us, laser_exposure_us, laser_power, background_above_levels } = of;
        Self { board_exposure_us, laser_exposure_us, laser_power, background_above_levels }
    }
}
