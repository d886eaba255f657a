//! What a session still needs, and the board as detected in one frame, on the wire.

use app::sessions::{BoardDetection, CameraSoFar, Need, SessionNeeds};
use serde::Serialize;
use utoipa::ToSchema;

/// Camera estimate from the boards so far.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct CameraEstimateDto {
    /// Focal length along u.
    pub focal_px: Option<f64>,
    /// RMS reprojection error of all corners.
    pub rms_px: Option<f64>,
    /// Cells of the coverage map not covered by any board yet.
    pub uncovered_cells: Vec<u32>,
    /// What is still missing and what to do.
    pub problem: Option<String>,
}

/// The requirements of the steps of a session.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct SessionNeedsDto {
    /// Boards with detected corners.
    pub boards: RequirementDto,
    /// Covered cells of the coverage map.
    pub cells: RequirementDto,
    /// Boards tilted by `tilted_deg` or more.
    pub tilted_boards: RequirementDto,
    /// Tilt from which a board counts as tilted, degrees.
    pub tilted_deg: f64,
    /// Spread of the board distances, mm.
    pub distance_mm: RequirementDto,
    /// Whether all requirements of the camera step are met.
    pub camera_met: bool,
    /// Boards with detected laser lines.
    pub laser_boards: RequirementDto,
    /// Stage positions with a detected board.
    pub stage_views: RequirementDto,
}

/// One requirement of a calibration.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct RequirementDto {
    /// Current value.
    pub actual: f64,
    /// Required value.
    pub required: f64,
    /// Whether the requirement is met.
    pub met: bool,
}

/// The board as detected in one frame. Nothing is stored.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct BoardDetectionDto {
    /// Sequence number of the frame, as in the live stream.
    pub sequence: u64,
    /// Middle of the exposure on the station's monotonic clock, ms.
    pub captured_ms: f64,
    /// Frame width.
    pub width_px: usize,
    /// Frame height.
    pub height_px: usize,
    /// Detected corners: column and row on the board, u and v in the frame (px), standard deviation (px).
    pub corners: Vec<[f64; 5]>,
    /// Cells of the coverage map (8 × 6, row by row from the top left) that contain corners.
    pub coverage_cells: Vec<u32>,
    /// Typical standard deviation of a corner; grows with blur, underexposure and noise.
    pub corner_sigma_px: Option<f64>,
    /// Fraction of saturated pixels.
    pub saturated_fraction: f64,
    /// Angle between the board and the image plane; available from three images on.
    pub tilt_deg: Option<f64>,
    /// Distance of the board centre; available from three images on.
    pub distance_mm: Option<f64>,
    /// RMS reprojection error of the corners, with the camera fitted to this frame as well.
    pub rms_px: Option<f64>,
    /// What is wrong and what to do.
    pub problem: Option<String>,
}

impl From<CameraSoFar> for CameraEstimateDto {
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
            laser_boards,
            stage_views,
        } = of;
        Self {
            boards: boards.into(),
            cells: cells.into(),
            tilted_boards: tilted_boards.into(),
            tilted_deg,
            distance_mm: distance_mm.into(),
            camera_met,
            laser_boards: laser_boards.into(),
            stage_views: stage_views.into(),
        }
    }
}

impl From<Need> for RequirementDto {
    fn from(of: Need) -> Self {
        let Need { actual, required, met } = of;
        Self { actual, required, met }
    }
}

impl From<BoardDetection> for BoardDetectionDto {
    fn from(of: BoardDetection) -> Self {
        let BoardDetection {
            sequence,
            captured_ms,
            width_px,
            height_px,
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
            sequence,
            captured_ms,
            width_px,
            height_px,
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
