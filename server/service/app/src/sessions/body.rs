//! What a calibration session knows: target, projector, pictures and what was found in each.

use capture::{GratingProjector, Target};
use optics::StagePosition;
use store::SessionRecord;

use crate::error::{AppError, ErrorKind};
use crate::sessions::photographer::Exposures;
use crate::sessions::stored::from_stored;

/// A session with its version.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// UUID v7.
    pub id: String,
    /// Grows with every change.
    pub version: i64,
    /// Everything else.
    pub body: SessionBody,
    /// When it was begun, ms since 1970.
    pub created_at_ms: i64,
    /// When it was changed last, ms since 1970.
    pub changed_at_ms: i64,
}

/// What a session has gathered.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionBody {
    /// What a person calls it.
    pub name: String,
    /// The board.
    pub target: Target,
    /// The laser and its grating.
    pub projector: ProjectorSheet,
    /// How pictures are exposed.
    pub exposures: Exposures,
    /// Columns of the pictures; 0 before the first.
    pub width_px: usize,
    /// Rows of the pictures; 0 before the first.
    pub height_px: usize,
    /// The board at rest.
    pub poses: Vec<SessionPose>,
    /// The board carried by the stage.
    pub stage_views: Vec<SessionStageView>,
    /// The camera as the boards so far give it.
    pub camera: CameraSoFar,
    /// The job that was started to solve it.
    pub job_id: Option<String>,
}

/// Laser and grating by their data sheets.
#[derive(Debug, Clone, PartialEq)]
pub struct ProjectorSheet {
    /// Wavelength of the laser.
    pub wavelength_nm: f64,
    /// Grooves of the grating.
    pub grating_lines_per_mm: f64,
    /// Orders from the top (left) of the image.
    pub orders: Vec<i8>,
    /// `rows` or `columns`.
    pub line_direction: String,
}

/// A picture in the store.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// The PNG file's SHA-256.
    pub artifact: String,
    /// How long it was exposed.
    pub exposure_us: f64,
    /// When it was taken, ms since 1970.
    pub taken_at_ms: i64,
}

/// A board picture and what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardPicture {
    /// The picture.
    pub picture: Picture,
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
#[derive(Debug, Clone, PartialEq)]
pub struct LaserPicture {
    /// The picture.
    pub picture: Picture,
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
#[derive(Debug, Clone, PartialEq)]
pub struct SessionPose {
    /// UUID v7.
    pub id: String,
    /// By ordinary light.
    pub board: BoardPicture,
    /// By laser light; without it the pose serves the camera alone.
    pub laser: Option<LaserPicture>,
}

/// The board at a stage position.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionStageView {
    /// UUID v7.
    pub id: String,
    /// Position read back from the stage.
    pub position: StagePosition,
    /// By ordinary light.
    pub board: BoardPicture,
}

/// The camera as the boards so far give it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CameraSoFar {
    /// Focal length along u.
    pub focal_px: Option<f64>,
    /// RMS distance of all corners.
    pub rms_px: Option<f64>,
    /// Cells of the coverage map that no board has reached yet.
    pub uncovered_cells: Vec<u32>,
    /// What is still missing, and what to do.
    pub problem: Option<String>,
}

impl BoardPicture {
    /// Whether a calibration can use it.
    pub fn is_readable(&self) -> bool {
        !self.corners.is_empty()
    }
}

impl LaserPicture {
    /// Whether a calibration can use it.
    pub fn is_readable(&self) -> bool {
        self.n_segments > 0
    }
}

impl From<ProjectorSheet> for GratingProjector {
    fn from(sheet: ProjectorSheet) -> Self {
        Self {
            wavelength_nm: sheet.wavelength_nm,
            grating_lines_per_mm: sheet.grating_lines_per_mm,
            orders: sheet.orders,
            line_direction: (sheet.line_direction != "rows").then_some(sheet.line_direction),
        }
    }
}

impl From<GratingProjector> for ProjectorSheet {
    fn from(projector: GratingProjector) -> Self {
        Self {
            wavelength_nm: projector.wavelength_nm,
            grating_lines_per_mm: projector.grating_lines_per_mm,
            orders: projector.orders,
            line_direction: projector.line_direction.unwrap_or_else(|| "rows".to_owned()),
        }
    }
}

impl TryFrom<SessionRecord> for Session {
    type Error = AppError;

    fn try_from(record: SessionRecord) -> Result<Self, AppError> {
        let body = from_stored(record.body).map_err(|cause| {
            AppError::new(ErrorKind::Internal, format!("session {} cannot be read", record.id))
                .because(cause.to_string())
                .remedy("begin a new session")
        })?;
        let SessionRecord { id, version, created_at_ms, changed_at_ms, .. } = record;
        Ok(Self { id, version, body, created_at_ms, changed_at_ms })
    }
}
