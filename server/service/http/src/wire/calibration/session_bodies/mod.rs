//! What a calibration session has gathered, on the wire.

mod needs;
mod pictures;

use app::sessions::photographer::Exposures;
use app::sessions::{ProjectorSheet, SessionBody};

use crate::wire::calibration::target::TargetDto;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use needs::{CameraSoFarDto, LookDto, SessionNeedsDto};
pub use pictures::{SessionPoseDto, SessionStageViewDto};

/// What a session has gathered.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionBodyDto {
    /// What a person calls it.
    pub name: String,
    /// The board.
    pub target: TargetDto,
    /// The laser and its grating.
    pub projector: ProjectorSheetDto,
    /// How pictures are exposed.
    pub exposures: ExposuresDto,
    /// Columns of the pictures; 0 before the first.
    pub width_px: usize,
    /// Rows of the pictures; 0 before the first.
    pub height_px: usize,
    /// The board at rest.
    pub poses: Vec<SessionPoseDto>,
    /// The board carried by the stage.
    pub stage_views: Vec<SessionStageViewDto>,
    /// The camera as the boards so far give it.
    pub camera: CameraSoFarDto,
    /// The job that was started to solve it.
    pub job_id: Option<String>,
}

/// Laser and grating by their data sheets.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct ProjectorSheetDto {
    /// Wavelength of the laser.
    pub wavelength_nm: f64,
    /// Grooves of the grating.
    pub grating_lines_per_mm: f64,
    /// Orders from the top (left) of the image.
    pub orders: Vec<i8>,
    /// `rows` or `columns`.
    pub line_direction: String,
}

/// How long the camera looks, and how bright the laser is.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
pub struct ExposuresDto {
    /// For the board, with the laser off.
    pub board_exposure_us: f64,
    /// For the laser lines.
    pub laser_exposure_us: f64,
    /// Share of full laser power, above 0 and at most 1.
    pub laser_power: f64,
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

impl From<ProjectorSheet> for ProjectorSheetDto {
    fn from(of: ProjectorSheet) -> Self {
        let ProjectorSheet { wavelength_nm, grating_lines_per_mm, orders, line_direction } = of;
        Self { wavelength_nm, grating_lines_per_mm, orders, line_direction }
    }
}

impl From<ProjectorSheetDto> for ProjectorSheet {
    fn from(of: ProjectorSheetDto) -> Self {
        let ProjectorSheetDto { wavelength_nm, grating_lines_per_mm, orders, line_direction } = of;
        Self { wavelength_nm, grating_lines_per_mm, orders, line_direction }
    }
}

impl From<Exposures> for ExposuresDto {
    fn from(of: Exposures) -> Self {
        let Exposures { board_exposure_us, laser_exposure_us, laser_power } = of;
        Self { board_exposure_us, laser_exposure_us, laser_power }
    }
}

impl From<ExposuresDto> for Exposures {
    fn from(of: ExposuresDto) -> Self {
        let ExposuresDto { board_exposure_us, laser_exposure_us, laser_power } = of;
        Self { board_exposure_us, laser_exposure_us, laser_power }
    }
}
