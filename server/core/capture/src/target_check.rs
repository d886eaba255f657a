//! Checks of the values of a calibration board.

use std::borrow::Cow;

use remedy::Remedy;
use vision::{CharucoError, CharucoParams};

use crate::params::{CORNERS_MAX, CORNERS_MIN};
use crate::target::{CharucoTarget, ChessboardTarget, CirclesTarget, SquareMm, Target};

/// Why a board is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TargetError {
    /// A count or length outside its range.
    #[error("a target's {entry} cannot be {value}")]
    OutOfRange {
        /// The entry of `target`.
        entry: &'static str,
        /// As given.
        value: f64,
        /// What is allowed, in words.
        expected: &'static str,
    },
    /// The markers of a ChArUco board are impossible.
    #[error("a target's dictionary is not suitable for this board")]
    Markers {
        /// Why, and the remedy.
        #[source]
        cause: CharucoError,
    },
}

impl TargetError {
    /// The wrong entry of `target`.
    pub fn entry(&self) -> &'static str {
        match self {
            Self::OutOfRange { entry, .. } => entry,
            Self::Markers { .. } => "dictionary",
        }
    }
}

impl Remedy for TargetError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        match self {
            Self::OutOfRange { expected, .. } => Some(format!("give {expected}").into()),
            Self::Markers { cause } => cause.remedy(),
        }
    }
}

impl Target {
    /// Checks that such a board is possible; returns an error for the first wrong entry.
    ///
    /// # Errors
    /// [`TargetError`].
    pub fn check(&self) -> Result<(), TargetError> {
        match self {
            Self::Chessboard(board) => check_chessboard(board),
            Self::Charuco(board) => check_charuco(board),
            Self::Circles(grid) => check_circles(grid, false),
            Self::AsymmetricCircles(grid) => check_circles(grid, true),
        }
    }
}

fn check_chessboard(board: &ChessboardTarget) -> Result<(), TargetError> {
    for (entry, n_corners) in [("inner_columns", board.inner_columns), ("inner_rows", board.inner_rows)] {
        let expected = "the number of inner corners along that side, between 2 and 1000";
        check_count(entry, n_corners, n_corners, expected)?;
    }
    check_square(board.square_mm)
}

fn check_charuco(board: &CharucoTarget) -> Result<(), TargetError> {
    for (entry, n_squares) in [("columns", board.columns), ("rows", board.rows)] {
        let expected = "the number of squares along that side, between 3 and 1001";
        check_count(entry, n_squares, n_squares.saturating_sub(1), expected)?;
    }
    check_square(board.square_mm)?;
    let side_mm = board.square_mm.x_mm.min(board.square_mm.y_mm);
    let fits = board.marker_mm > 0.0 && board.marker_mm < side_mm;
    check_range("marker_mm", board.marker_mm, fits, "a length above 0 and below that of a square")?;
    let params = CharucoParams {
        columns: board.columns,
        rows: board.rows,
        marker_ratio: board.marker_mm / side_mm,
        dictionary: board.dictionary.clone(),
    };
    params.check().map_err(|cause| TargetError::Markers { cause })
}

/// Discs must not touch: their centres are one step apart, or on the diagonal in an asymmetric grid.
fn check_circles(grid: &CirclesTarget, asymmetric: bool) -> Result<(), TargetError> {
    for (entry, count) in [("columns", grid.columns), ("rows", grid.rows)] {
        check_count(entry, count, count, "the number of discs along that side, between 2 and 1000")?;
    }
    check_square(grid.square_mm)?;
    let SquareMm { x_mm, y_mm } = grid.square_mm;
    let nearest_mm = if asymmetric { x_mm.hypot(y_mm).min(2.0 * x_mm).min(2.0 * y_mm) } else { x_mm.min(y_mm) };
    let fits = grid.diameter_mm > 0.0 && grid.diameter_mm < nearest_mm;
    let expected = "a length above 0 and below the distance of neighbouring discs";
    check_range("diameter_mm", grid.diameter_mm, fits, expected)
}

/// `count` is the entry's, `n_corners` the resulting number of corners.
fn check_count(
    entry: &'static str,
    count: usize,
    n_corners: usize,
    expected: &'static str,
) -> Result<(), TargetError> {
    check_range(entry, count as f64, (CORNERS_MIN..=CORNERS_MAX).contains(&n_corners), expected)
}

fn check_square(SquareMm { x_mm, y_mm }: SquareMm) -> Result<(), TargetError> {
    [x_mm, y_mm].into_iter().try_for_each(|side_mm| {
        check_range("square_mm", side_mm, side_mm.is_finite() && side_mm > 0.0, "a finite number above 0")
    })
}

fn check_range(
    entry: &'static str,
    value: f64,
    is_allowed: bool,
    expected: &'static str,
) -> Result<(), TargetError> {
    if is_allowed { Ok(()) } else { Err(TargetError::OutOfRange { entry, value, expected }) }
}
