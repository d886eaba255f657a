//! Detection of the board in the current frame, before an image is captured.

use station::StampedFrame;

use crate::error::{AppError, ErrorKind};
use crate::sessions::body::{BoardImage, SessionBody, SessionImage, SessionPose};
use crate::sessions::camera_so_far::learn_camera;
use crate::sessions::found;

/// The board as detected in one frame. Nothing is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardDetection {
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

/// The detection in `frame`, as part of the session `body`.
///
/// # Errors
/// A problem if the frame size differs from that of the session's images.
pub fn detect_in_frame(frame: &StampedFrame, mut body: SessionBody) -> Result<BoardDetection, AppError> {
    let (width_px, height_px) = (frame.image.width(), frame.image.height());
    check_size(&body, (width_px, height_px))?;
    (body.width_px, body.height_px) = (width_px, height_px);
    let unkept =
        SessionImage { artifact: String::new(), exposure_us: frame.exposure_us, taken_at_ms: 0, dark_frame: None };
    let mut board = found::board_in(&frame.image, unkept, &body.target);
    if frame.laser_on {
        board.problem = Some("the laser is on; turn it off for images of the board".to_owned());
    }
    if board.is_readable() {
        body.poses.push(SessionPose { id: String::new(), board, laser: None });
        learn_camera(&mut body);
        board = body.poses.swap_remove(body.poses.len() - 1).board;
    }
    let BoardImage { corners, coverage_cells, corner_sigma_px, saturated_fraction, .. } = board;
    Ok(BoardDetection {
        sequence: frame.sequence,
        captured_ms: frame.captured_at_ns as f64 / 1e6,
        width_px,
        height_px,
        corners,
        coverage_cells,
        corner_sigma_px,
        saturated_fraction,
        tilt_deg: board.tilt_deg,
        distance_mm: board.distance_mm,
        rms_px: board.rms_px,
        problem: board.problem,
    })
}

/// All images of a session have the same size.
///
/// # Errors
/// A problem if this one differs.
pub fn check_size(body: &SessionBody, size_px: (usize, usize)) -> Result<(), AppError> {
    if body.width_px == 0 || size_px == (body.width_px, body.height_px) {
        return Ok(());
    }
    Err(AppError::new(ErrorKind::Conflict, "the image size of the camera changed during the session")
        .remedy("restore the setting, or start a new session"))
}
