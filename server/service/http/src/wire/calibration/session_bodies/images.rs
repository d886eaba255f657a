//! The images of a session and what was detected in them, on the wire.

use app::sessions::{BoardImage, LaserImage, SessionImage, SessionPose, SessionStageView};
use serde::Serialize;
use utoipa::ToSchema;

/// A stored image.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ImageDto {
    /// SHA-256 of the PNG file.
    pub artifact: String,
    /// Exposure time.
    pub exposure_us: f64,
    /// Time of capture, ms since 1970 (UTC).
    pub taken_at_ms: i64,
}

/// A board image and its detections.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct BoardImageDto {
    /// The image.
    pub image: ImageDto,
    /// Detected corners: column and row on the board, u and v in the image (px), standard deviation (px).
    pub corners: Vec<[f64; 5]>,
    /// Cells of the coverage map (8 × 6, row by row from the top left) that contain corners.
    pub coverage_cells: Vec<u32>,
    /// Typical standard deviation of a corner; grows with blur, underexposure and noise.
    pub corner_sigma_px: Option<f64>,
    /// Fraction of saturated pixels.
    pub saturated_fraction: f64,
    /// Angle between the board and the image plane; available once the camera is estimated.
    pub tilt_deg: Option<f64>,
    /// Distance of the board centre; available from three images on.
    pub distance_mm: Option<f64>,
    /// RMS reprojection error with the current camera estimate.
    pub rms_px: Option<f64>,
    /// What is wrong and what to do.
    pub problem: Option<String>,
}

/// A laser image and its detections.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct LaserImageDto {
    /// The image.
    pub image: ImageDto,
    /// The laser-off image that was subtracted from it, if the ambient light is above the limit.
    pub background: Option<ImageDto>,
    /// Number of line segments.
    pub n_segments: usize,
    /// Number of line points.
    pub n_points: usize,
    /// Every sixteenth point of each segment, u and v, for display.
    pub lines_px: Vec<Vec<[f64; 2]>>,
    /// Fraction of saturated pixels.
    pub saturated_fraction: f64,
    /// What is wrong and what to do.
    pub problem: Option<String>,
}

/// A captured pose of the board.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionPoseDto {
    /// UUID v7.
    pub id: String,
    /// Image with the laser off.
    pub board: BoardImageDto,
    /// Image with the laser on; without it the pose is used for the camera only.
    pub laser: Option<LaserImageDto>,
}

/// The board at a stage position.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionStageViewDto {
    /// UUID v7.
    pub id: String,
    /// Position read back from a linear stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// Angle read back from a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// Image with the laser off.
    pub board: BoardImageDto,
}

impl From<SessionImage> for ImageDto {
    fn from(of: SessionImage) -> Self {
        let SessionImage { artifact, exposure_us, taken_at_ms, dark_frame: _ } = of;
        Self { artifact, exposure_us, taken_at_ms }
    }
}

impl From<BoardImage> for BoardImageDto {
    fn from(of: BoardImage) -> Self {
        let BoardImage {
            image,
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_fraction,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        } = of;
        Self {
            image: image.into(),
            corners,
            coverage_cells,
            corner_sigma_px,
            saturated_fraction,
            tilt_deg,
            distance_mm,
            rms_px,
            problem,
        }
    }
}

impl From<LaserImage> for LaserImageDto {
    fn from(of: LaserImage) -> Self {
        let LaserImage { image, background, n_segments, n_points, lines_px, saturated_fraction, problem } = of;
        Self {
            image: image.into(),
            background: background.map(Into::into),
            n_segments,
            n_points,
            lines_px,
            saturated_fraction,
            problem,
        }
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
