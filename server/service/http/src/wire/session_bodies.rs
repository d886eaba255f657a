//! What a calibration session has gathered, on the wire.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use app::sessions::photographer::Exposures;
use app::sessions::{
    BoardPicture, CameraSoFar, LaserPicture, Look, Need, Picture, ProjectorSheet, SessionBody, SessionNeeds,
    SessionPose, SessionStageView,
};

use crate::wire::target::TargetDto;

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

/// A picture in the store.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct PictureDto {
    /// The PNG file's SHA-256.
    pub artifact: String,
    /// How long it was exposed.
    pub exposure_us: f64,
    /// When it was taken, ms since 1970.
    pub taken_at_ms: i64,
}

/// A board picture and what was found in it.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct BoardPictureDto {
    /// The picture.
    pub picture: PictureDto,
    /// Corners: column and row on the board, u and v in the picture (px), standard deviation (px).
    pub corners: Vec<[f64; 5]>,
    /// Cells of the coverage map (8 × 6, row by row from the top left) that hold corners.
    pub coverage_cells: Vec<u32>,
    /// Typical standard deviation of a corner: grows with blur, darkness and noise.
    pub corner_sigma_px: Option<f64>,
    /// Share of pixels at the sensor's limit.
    pub saturated_share: f64,
    /// Angle between the board and the picture plane; once the camera is known.
    pub tilt_deg: Option<f64>,
    /// Distance of the board's middle; once the camera is known.
    pub distance_mm: Option<f64>,
    /// RMS distance of the corners from where the camera so far expects them.
    pub rms_px: Option<f64>,
    /// What is wrong with it, and what to do.
    pub problem: Option<String>,
}

/// A laser picture and what was found in it.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct LaserPictureDto {
    /// The picture.
    pub picture: PictureDto,
    /// Pieces of lines.
    pub n_segments: usize,
    /// Points on them.
    pub n_points: usize,
    /// Every sixteenth point of each piece, u and v, for drawing.
    pub lines_px: Vec<Vec<[f64; 2]>>,
    /// Share of pixels at the sensor's limit.
    pub saturated_share: f64,
    /// What is wrong with it, and what to do.
    pub problem: Option<String>,
}

/// A pose of the board at rest.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionPoseDto {
    /// UUID v7.
    pub id: String,
    /// By ordinary light.
    pub board: BoardPictureDto,
    /// By laser light; without it the pose serves the camera alone.
    pub laser: Option<LaserPictureDto>,
}

/// The board at a stage position.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionStageViewDto {
    /// UUID v7.
    pub id: String,
    /// Position read back from the stage.
    pub position_mm: f64,
    /// By ordinary light.
    pub board: BoardPictureDto,
}

/// The camera as the boards so far give it.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct CameraSoFarDto {
    /// Focal length along u.
    pub focal_px: Option<f64>,
    /// RMS distance of all corners.
    pub rms_px: Option<f64>,
    /// Cells of the coverage map that no board has reached yet.
    pub uncovered_cells: Vec<u32>,
    /// What is still missing, and what to do.
    pub problem: Option<String>,
}

/// What the steps of a session have and want.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionNeedsDto {
    /// Boards with corners.
    pub boards: NeedDto,
    /// Cells of the coverage map with corners.
    pub cells: NeedDto,
    /// Boards tilted by `tilted_deg` or more.
    pub tilted_boards: NeedDto,
    /// Tilt from which a board counts as tilted, degrees.
    pub tilted_deg: f64,
    /// Range of the boards' distances, mm.
    pub distance_mm: NeedDto,
    /// Whether the camera's step has all of these.
    pub camera_met: bool,
    /// Boards with laser lines.
    pub lit_boards: NeedDto,
    /// Positions of the stage with a readable board.
    pub stage_views: NeedDto,
}

/// One thing a calibration wants.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct NeedDto {
    /// What is there.
    pub have: f64,
    /// What is wanted.
    pub want: f64,
    /// Whether that is enough.
    pub met: bool,
}

/// What one frame shows of the board. Nothing of it is kept.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct LookDto {
    /// The station's count of the frame, as in the live stream.
    pub sequence: u64,
    /// Middle of its exposure on the station's clock, ms.
    pub captured_ms: f64,
    /// Columns of the frame.
    pub width_px: usize,
    /// Rows of the frame.
    pub height_px: usize,
    /// Corners: column and row on the board, u and v in the frame (px), standard deviation (px).
    pub corners: Vec<[f64; 5]>,
    /// Cells of the coverage map (8 × 6, row by row from the top left) that hold corners.
    pub coverage_cells: Vec<u32>,
    /// Typical standard deviation of a corner: grows with blur, darkness and noise.
    pub corner_sigma_px: Option<f64>,
    /// Share of pixels at the sensor's limit.
    pub saturated_share: f64,
    /// Angle between the board and the picture plane; once the camera is known, from three pictures on.
    pub tilt_deg: Option<f64>,
    /// Distance of the board's middle; once the camera is known.
    pub distance_mm: Option<f64>,
    /// RMS distance of the corners from where the camera, fitted with this frame too, expects them.
    pub rms_px: Option<f64>,
    /// What is wrong with it, and what to do.
    pub problem: Option<String>,
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

impl From<Picture> for PictureDto {
    fn from(of: Picture) -> Self {
        let Picture { artifact, exposure_us, taken_at_ms } = of;
        Self { artifact, exposure_us, taken_at_ms }
    }
}

impl From<BoardPicture> for BoardPictureDto {
    fn from(of: BoardPicture) -> Self {
        let BoardPicture {
            picture,
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        } = of;
        Self {
            picture: picture.into(),
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        }
    }
}

impl From<LaserPicture> for LaserPictureDto {
    fn from(of: LaserPicture) -> Self {
        let LaserPicture { picture, n_segments, n_points, lines_px, saturated_share, problem } = of;
        Self { picture: picture.into(), n_segments, n_points, lines_px, saturated_share, problem }
    }
}

impl From<SessionPose> for SessionPoseDto {
    fn from(of: SessionPose) -> Self {
        let SessionPose { id, board, laser } = of;
        Self { id, board: board.into(), laser: laser.map(Into::into) }
    }
}

impl From<SessionStageView> for SessionStageViewDto {
    fn from(of: SessionStageView) -> Self {
        let SessionStageView { id, position_mm, board } = of;
        Self { id, position_mm, board: board.into() }
    }
}

impl From<CameraSoFar> for CameraSoFarDto {
    fn from(of: CameraSoFar) -> Self {
        let CameraSoFar { focal_px, rms_px, uncovered_cells, problem } = of;
        Self { focal_px, rms_px, uncovered_cells, problem }
    }
}

impl From<SessionNeeds> for SessionNeedsDto {
    fn from(of: SessionNeeds) -> Self {
        let SessionNeeds {
            boards,
            cells,
            tilted_boards,
            tilted_deg,
            distance_mm,
            camera_met,
            lit_boards,
            stage_views,
        } = of;
        Self {
            boards: boards.into(),
            cells: cells.into(),
            tilted_boards: tilted_boards.into(),
            tilted_deg,
            distance_mm: distance_mm.into(),
            camera_met,
            lit_boards: lit_boards.into(),
            stage_views: stage_views.into(),
        }
    }
}

impl From<Need> for NeedDto {
    fn from(of: Need) -> Self {
        let Need { have, want, met } = of;
        Self { have, want, met }
    }
}

impl From<Look> for LookDto {
    fn from(of: Look) -> Self {
        let Look {
            sequence,
            captured_ms,
            width_px,
            height_px,
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        } = of;
        Self {
            sequence,
            captured_ms,
            width_px,
            height_px,
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_share,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        }
    }
}
