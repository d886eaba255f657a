//! The content of a calibration session: target, projector, images and their detections.

use capture::{Projector, Target};
use optics::StagePosition;
use store::SessionRecord;

use crate::camera::correction::ImageDarkFrame;
use crate::error::{AppError, ErrorKind};
use crate::sessions::image_capture::Exposures;
use crate::sessions::stored::from_stored;

/// A session with its version.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// UUID v7.
    pub id: String,
    /// Version; increases with every change.
    pub version: i64,
    /// The content.
    pub body: SessionBody,
    /// Time of creation, ms since 1970 (UTC).
    pub created_at_ms: i64,
    /// Time of the last change, ms since 1970 (UTC).
    pub changed_at_ms: i64,
}

/// The content of a calibration session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionBody {
    /// Its name.
    pub name: String,
    /// The calibration board.
    pub target: Target,
    /// Nominal values of the line projector.
    pub projector: Projector,
    /// Exposure settings.
    pub exposures: Exposures,
    /// Image width; 0 before the first image.
    pub width_px: usize,
    /// Image height; 0 before the first image.
    pub height_px: usize,
    /// Captured poses of the board.
    pub poses: Vec<SessionPose>,
    /// The board on the stage, at several positions.
    pub stage_views: Vec<SessionStageView>,
    /// Camera estimate from the boards so far.
    pub camera: CameraSoFar,
    /// The calibration job started from this session.
    pub job_id: Option<String>,
}

/// A stored image.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionImage {
    /// SHA-256 of the PNG file.
    pub artifact: String,
    /// Exposure time.
    pub exposure_us: f64,
    /// Time of capture, ms since 1970 (UTC).
    pub taken_at_ms: i64,
    /// The dark frame it was corrected with; `None` if it was not corrected.
    pub dark_frame: Option<ImageDarkFrame>,
}

/// A board image and its detections.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardImage {
    /// The image.
    pub image: SessionImage,
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
#[derive(Debug, Clone, PartialEq)]
pub struct LaserImage {
    /// The image.
    pub image: SessionImage,
    /// The laser-off image that was subtracted from it, if the ambient light is above the limit.
    pub background: Option<SessionImage>,
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
#[derive(Debug, Clone, PartialEq)]
pub struct SessionPose {
    /// UUID v7.
    pub id: String,
    /// Image with the laser off.
    pub board: BoardImage,
    /// Image with the laser on; without it the pose is used for the camera only.
    pub laser: Option<LaserImage>,
}

/// The board at a stage position.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionStageView {
    /// UUID v7.
    pub id: String,
    /// Position read back from the stage.
    pub position: StagePosition,
    /// Image with the laser off.
    pub board: BoardImage,
}

/// Camera estimate from the boards so far.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CameraSoFar {
    /// Focal length along u.
    pub focal_px: Option<f64>,
    /// RMS reprojection error of all corners.
    pub rms_px: Option<f64>,
    /// Cells of the coverage map not covered by any board yet.
    pub uncovered_cells: Vec<u32>,
    /// What is still missing and what to do.
    pub problem: Option<String>,
}

impl BoardImage {
    /// Whether it is usable for a calibration.
    pub fn is_readable(&self) -> bool {
        !self.corners.is_empty()
    }
}

impl LaserImage {
    /// Whether it is usable for a calibration.
    pub fn is_readable(&self) -> bool {
        self.n_segments > 0
    }
}

impl TryFrom<SessionRecord> for Session {
    type Error = AppError;

    fn try_from(record: SessionRecord) -> Result<Self, AppError> {
        let body = from_stored(record.body).map_err(|cause| {
            AppError::new(ErrorKind::Internal, format!("session {} cannot be read", record.id))
                .because(cause.to_string())
                .remedy("start a new session")
        })?;
        let SessionRecord { id, version, created_at_ms, changed_at_ms, .. } = record;
        Ok(Self { id, version, body, created_at_ms, changed_at_ms })
    }
}
