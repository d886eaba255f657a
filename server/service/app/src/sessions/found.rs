//! Detections in a session image, reported at once so that the user can capture it again.

use std::collections::BTreeSet;

use capture::Target;
use pipeline::find_board;
use vision::{BoardCorners, CentrelineParams, GreyImage, LineDirection, Pixels, find_centrelines};

use crate::camera::background::Background;
use crate::sessions::body::{BoardImage, LaserImage, SessionImage};

/// Columns and rows of the coverage map: coarse enough to be covered by a dozen boards.
pub const COVERAGE: (usize, usize) = (8, 6);

/// Corner σ above which the image counts as blurred or underexposed: ten times the usual.
const BLURRED_SIGMA_PX: f64 = 0.1;

/// Fraction of saturated pixels from which a board image counts as overexposed: glare on a few squares.
const GLARE_FRACTION: f64 = 0.02;

/// Subsampling of line points for display.
const DRAWN_EVERY: usize = 16;

/// Detects the board.
pub fn board_in(image: &GreyImage, stored: SessionImage, target: &Target) -> BoardImage {
    let saturated_fraction = saturated_fraction(image);
    let mut found = BoardImage {
        image: stored,
        corners: Vec::new(),
        coverage_cells: Vec::new(),
        corner_sigma_px: None,
        saturated_fraction,
        tilt_deg: None,
        distance_mm: None,
        rms_px: None,
        problem: None,
    };
    match find_board(image, target) {
        Err(error) => {
            let needed = if matches!(target, Target::Charuco(_)) { "more of" } else { "the whole" };
            found.problem =
                Some(format!("{error}; hold {needed} board in the image, evenly illuminated and in focus"));
        }
        Ok(board) => {
            found.coverage_cells = covered(&board, image.width(), image.height());
            found.corner_sigma_px = Some(median_sigma_px(&board));
            found.problem = weakness(found.corner_sigma_px, saturated_fraction);
            let corner = |corner: &vision::Corner| {
                [corner.column as f64, corner.row as f64, corner.u_px, corner.v_px, corner.sigma_px]
            };
            found.corners = board.corners.iter().map(corner).collect();
        }
    }
    found
}

/// Detects laser lines in an image minus its laser-off image, if there is one. A laser-off image of another scene is not
/// used.
pub fn lines_in(
    image: &GreyImage,
    stored: SessionImage,
    background: Option<(Background, SessionImage)>,
    line_direction: LineDirection,
) -> LaserImage {
    let is_changed = background.as_ref().is_some_and(|(taken, _)| !taken.suits(image));
    let background = background.filter(|_| !is_changed);
    let difference = background.as_ref().and_then(|(taken, _)| taken.subtracted_from(image));
    let searched = difference.as_ref().unwrap_or(image);
    let lines = find_centrelines(searched, &CentrelineParams { line_direction, ..CentrelineParams::default() });
    let drawn = lines
        .segments
        .iter()
        .map(|segment| segment.points.iter().step_by(DRAWN_EVERY).map(|point| [point.u_px, point.v_px]).collect());
    let changed = "the board or its light changed between the images with the laser on and off, so the ambient light \
                   cannot be subtracted; hold it still and keep the light as it is";
    let nothing = "no laser line was detected; check that the laser is on and the exposure is long enough";
    let problem = if lines.segments.is_empty() { Some(nothing) } else { is_changed.then_some(changed) };
    LaserImage {
        image: stored,
        background: background.map(|(_, stored)| stored),
        n_segments: lines.segments.len(),
        n_points: lines.segments.iter().map(|segment| segment.points.len()).sum(),
        lines_px: drawn.collect(),
        saturated_fraction: saturated_fraction(image),
        problem: problem.map(str::to_owned),
    }
}

fn weakness(sigma_px: Option<f64>, saturated_fraction: f64) -> Option<String> {
    if sigma_px.is_some_and(|sigma_px| sigma_px > BLURRED_SIGMA_PX) {
        return Some("the board is blurred or dark; hold it still, focus, or increase the exposure".to_owned());
    }
    (saturated_fraction > GLARE_FRACTION)
        .then(|| "the board is overexposed; reduce the exposure or tilt it to avoid glare".to_owned())
}

fn covered(board: &BoardCorners, width_px: usize, height_px: usize) -> Vec<u32> {
    let cell = |at_px: f64, count: usize, side: usize| {
        ((at_px + 0.5) / side as f64 * count as f64).clamp(0.0, count as f64 - 1.0) as u32
    };
    let cells: BTreeSet<u32> = board
        .corners
        .iter()
        .map(|corner| {
            cell(corner.v_px, COVERAGE.1, height_px) * COVERAGE.0 as u32 + cell(corner.u_px, COVERAGE.0, width_px)
        })
        .collect();
    cells.into_iter().collect()
}

fn median_sigma_px(board: &BoardCorners) -> f64 {
    let mut sigmas: Vec<f64> = board.corners.iter().map(|corner| corner.sigma_px).collect();
    statistics::median(&mut sigmas).unwrap_or(f64::NAN)
}

fn saturated_fraction(image: &GreyImage) -> f64 {
    let n_saturated = match image.pixels() {
        Pixels::Eight(pixels) => pixels.iter().filter(|level| **level == u8::MAX).count(),
        Pixels::Sixteen(pixels) => pixels.iter().filter(|level| **level == u16::MAX).count(),
    };
    n_saturated as f64 / (image.width() * image.height()) as f64
}
