//! The pictures of a session and what was found in them, on the wire.

use app::sessions::{BoardPicture, LaserPicture, Picture, SessionPose, SessionStageView};
use serde::Serialize;
use utoipa::ToSchema;

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
    /// Position read back from a stage that travels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Angle read back from a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// By ordinary light.
    pub board: BoardPictureDto,
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
        let SessionStageView { id, position, board } = of;
        Self { id, position_mm: position.mm(), angle_deg: position.deg(), board: board.into() }
    }
}
