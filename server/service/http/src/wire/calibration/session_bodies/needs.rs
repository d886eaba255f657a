//! What a session still wants, and what one look at the board shows, on the wire.

use app::sessions::{CameraSoFar, Look, Need, SessionNeeds};
use serde::Serialize;
use utoipa::ToSchema;

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
