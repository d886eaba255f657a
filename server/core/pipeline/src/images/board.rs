//! Detection of calibration boards of any kind.

use calibration::{BoardGeometry, BoardPattern};
use capture::{CirclesTarget, Target};
use vision::{
    BoardCorners, CharucoParams, CircleParams, CornerError, CornerParams, GreyImage, find_charuco, find_circles,
    find_corners,
};

/// Finds the corners, or the centres of the discs, of the board described by `target`.
///
/// # Errors
/// [`CornerError`]: the board is not found.
pub fn find_board(image: &GreyImage, target: &Target) -> Result<BoardCorners, CornerError> {
    let circles = |grid: &CirclesTarget, staggered: bool| {
        find_circles(image, &CircleParams { columns: grid.columns, rows: grid.rows, staggered })
    };
    match target {
        Target::Chessboard(board) => {
            find_corners(image, &CornerParams { inner_columns: board.inner_columns, inner_rows: board.inner_rows })
        }
        Target::Charuco(board) => find_charuco(
            image,
            &CharucoParams {
                columns: board.columns,
                rows: board.rows,
                marker_ratio: board.marker_mm / board.square_mm.x_mm.min(board.square_mm.y_mm),
                dictionary: board.dictionary.clone(),
            },
        ),
        Target::Circles(grid) => circles(grid, false),
        Target::AsymmetricCircles(grid) => circles(grid, true),
    }
}

/// Remedy for a board that was not found; `target` in `capture.json` states its size.
pub fn board_remedy(error: &CornerError, target: &Target) -> String {
    match (error, target) {
        (CornerError::WrongSize { found_columns, found_rows, .. }, _) => format!(
            "if the board has {found_columns}×{found_rows} inner corners, set target.inner_columns and \
             target.inner_rows in capture.json; if part of it is outside the image, retake the image"
        ),
        (_, Target::Chessboard(_)) => {
            "retake the image with the whole board in it, evenly lit and sharp".to_owned()
        }
        (_, Target::Charuco(_)) => "check columns, rows and dictionary of target in capture.json, or retake the image with more of the board in it, evenly lit and sharp"
            .to_owned(),
        (_, Target::Circles(_) | Target::AsymmetricCircles(_)) => {
            "check kind, columns and rows of target in capture.json, or retake the image with the whole grid in it, evenly lit and sharp"
                .to_owned()
        }
    }
}

/// The board's geometry for the calibration.
pub fn board_geometry(target: &Target) -> BoardGeometry {
    let (inner_columns, inner_rows) = target.inner_corners();
    let square = target.square_mm();
    BoardGeometry {
        inner_columns,
        inner_rows,
        square_mm: [square.x_mm, square.y_mm].into(),
        pattern: board_pattern(target),
    }
}

/// The board's pattern for the calibration.
fn board_pattern(target: &Target) -> BoardPattern {
    let circles =
        |grid: &CirclesTarget, staggered| BoardPattern::Circles { staggered, diameter_mm: grid.diameter_mm };
    match target {
        Target::Chessboard(_) => BoardPattern::Squares,
        Target::Charuco(_) => BoardPattern::Markers,
        Target::Circles(grid) => circles(grid, false),
        Target::AsymmetricCircles(grid) => circles(grid, true),
    }
}
