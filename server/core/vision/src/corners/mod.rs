//! Inner corners of a chessboard, with sub-pixel positions and standard deviations.
//!
//! # Rows and columns
//! Columns × rows have the same handedness as u × v (the board is seen from its front, never mirrored). Of the
//! orientations that fit the configured size, the one whose corner (0, 0) has a **dark** square diagonally outside is
//! chosen; for a board with one even and one odd count of inner corners this makes row r, column c the same physical
//! corner in every view. A board with both counts even or both odd looks the same after a rotation by 180°: its columns
//! run as nearly as possible towards +u.
//!
//! # Method
//! 1. `fast`: the lattice of a clearly visible board; otherwise `detect`: seeds from `calib-targets`, in several views
//!    of the image.
//! 2. `lattice`: seeds verified, holes filled, grown to the rim.
//! 3. `orientation`: size check and corner (0, 0).
//! 4. `refine`: a blurred-corner model fitted to each corner (`model`, `fit`, `sums`).

mod charuco;
mod circles;
mod finding;
mod fitting;
mod params;
#[cfg(test)]
mod tests;

use std::f64::consts::FRAC_1_SQRT_2;

use statistics::median;
use statrs::function::erf::erf;

use crate::GreyImage;

use finding::detect::search_seeds;
use finding::lattice::Lattice;
use finding::orientation::{Board, read_board};
use finding::partial::{PartialBoard, read_partial_board};
use fitting::window::Reach;
use params::{CONCLUSIVE_FRACTION, PART_MAX_SIGMA_MEDIANS, WINDOW_MAX_PX, WINDOW_SQUARES};

pub use charuco::{CharucoError, CharucoParams, find_charuco};
pub use circles::{CircleParams, find_circles};

/// Settings of the corner search.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerParams {
    /// Inner corners along a board row.
    pub inner_columns: usize,
    /// Inner corners along a board column.
    pub inner_rows: usize,
}

/// One inner corner in raw (distorted) sensor pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Board row, 0 … inner_rows − 1.
    pub row: usize,
    /// Board column, 0 … inner_columns − 1.
    pub column: usize,
    /// Column of the image.
    pub u_px: f64,
    /// Row of the image.
    pub v_px: f64,
    /// Predicted standard deviation per axis.
    pub sigma_px: f64,
}

/// The corners of one board that were found, row by row: the visible ones of a chessboard or ChArUco board, or the
/// centres of a circle grid.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardCorners {
    /// Inner corners along a board row.
    pub inner_columns: usize,
    /// Inner corners along a board column.
    pub inner_rows: usize,
    /// In row-major order.
    pub corners: Vec<Corner>,
}

/// Why a board could not be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CornerError {
    /// No chessboard was detected.
    #[error("no chessboard of {inner_columns}×{inner_rows} inner corners was found")]
    NotFound {
        /// Configured inner columns.
        inner_columns: usize,
        /// Configured inner rows.
        inner_rows: usize,
    },
    /// A chessboard of another size was detected.
    #[error(
        "found a chessboard of {found_columns}×{found_rows} inner corners, expected {inner_columns}×{inner_rows}"
    )]
    WrongSize {
        /// Configured inner columns.
        inner_columns: usize,
        /// Configured inner rows.
        inner_rows: usize,
        /// Detected inner columns.
        found_columns: usize,
        /// Detected inner rows.
        found_rows: usize,
    },
    /// A part of the board was detected whose position on the board is ambiguous.
    #[error(
        "found {found} inner corners of the {inner_columns}×{inner_rows} board, but their position on it is ambiguous: too little of the board's border is visible"
    )]
    Ambiguous {
        /// Configured inner columns.
        inner_columns: usize,
        /// Configured inner rows.
        inner_rows: usize,
        /// Corners found.
        found: usize,
    },
    /// No whole grid of discs was detected.
    #[error("no grid of {columns}×{rows} circles was found; the largest regular group has {found}")]
    NoCircles {
        /// Configured discs in a row.
        columns: usize,
        /// Configured rows.
        rows: usize,
        /// Discs in the largest regular group.
        found: usize,
    },
    /// The configured board was detected, but too many of its corners are hidden or unreadable.
    #[error("found {found} of the {needed} inner corners of the {inner_columns}×{inner_rows} board")]
    Incomplete {
        /// Configured inner columns.
        inner_columns: usize,
        /// Configured inner rows.
        inner_rows: usize,
        /// Corners found.
        found: usize,
        /// `inner_columns * inner_rows`.
        needed: usize,
    },
}

/// Finds the visible inner corners of the configured chessboard.
///
/// `image`: 8 or 16 bit, raw sensor pixels. Typical error per axis 0.005–0.01 px at squares of 60–90 px, a blur of 1 px
/// and 2 % noise; each corner has its own `sigma_px` (photon and read noise as estimated from the residuals; flatness
/// and print of a real board are not included).
///
/// Corners outside the image or covered are missing from the result, provided that the others can be identified: on a
/// board with one even and one odd count, by the borders that are visible.
///
/// # Errors
/// [`CornerError::NotFound`] without any chessboard, [`CornerError::WrongSize`] if the largest one found has another
/// size, [`CornerError::Ambiguous`] if a part of the board is visible but its position on the board is ambiguous,
/// [`CornerError::Incomplete`] if too many corners are covered, or any of a board that looks the same after a rotation
/// by 180°.
pub fn find_corners(image: &GreyImage, params: &CornerParams) -> Result<BoardCorners, CornerError> {
    let CornerParams { inner_columns, inner_rows } = *params;
    let mut failure = CornerError::NotFound { inner_columns, inner_rows };
    let mut largest = 0;
    let mut largest_part = Vec::new();
    let verdict = search_seeds(image, |seed| {
        let lattice = Lattice::from_seed(image, seed)?;
        let mut error = match board_from_lattice(&lattice, params) {
            Ok(first) => return Some(Ok(first)),
            Err(error) => error,
        };
        match read_partial_board(&lattice, inner_columns, inner_rows, [image.width(), image.height()]) {
            PartialBoard::Numbered(part) if part.len() > largest_part.len() => largest_part = part,
            PartialBoard::Ambiguous { found } if !matches!(error, CornerError::Incomplete { .. }) => {
                error = CornerError::Ambiguous { inner_columns, inner_rows, found };
            }
            PartialBoard::Numbered(_) | PartialBoard::Ambiguous { .. } | PartialBoard::Other => {}
        }
        let substantial =
            lattice.corners.len() as f64 >= CONCLUSIVE_FRACTION * (inner_columns * inner_rows) as f64;
        if substantial && error == failure {
            return Some(Err(error));
        }
        if lattice.corners.len() > largest {
            (largest, failure) = (lattice.corners.len(), error);
        }
        None
    });
    let first = match verdict.unwrap_or(Err(failure)) {
        Ok(whole) => {
            whole.into_iter().enumerate().map(|(k, fit)| ([k % inner_columns, k / inner_columns], fit)).collect()
        }
        Err(_) if !largest_part.is_empty() => largest_part,
        Err(failure) => return Err(failure),
    };
    Ok(refined(image, first, params))
}

/// Refits corners with their (column, row).
fn refined(
    image: &GreyImage,
    first: Vec<([usize; 2], fitting::fit::CornerFit)>,
    params: &CornerParams,
) -> BoardCorners {
    let CornerParams { inner_columns, inner_rows } = *params;
    let (indices, first): (Vec<_>, Vec<_>) = first.into_iter().unzip();
    let fits =
        fitting::refine::refine(image, &first, &indices, Reach { squares: WINDOW_SQUARES, max_px: WINDOW_MAX_PX });
    let is_whole = indices.len() == inner_columns * inner_rows;
    let is_usable = if is_whole { vec![true; fits.len()] } else { usable(&indices, &fits) };
    let corner = |([column, row], fit): (&[usize; 2], &fitting::fit::CornerFit)| Corner {
        row: *row,
        column: *column,
        u_px: fit.position_px[0],
        v_px: fit.position_px[1],
        sigma_px: fit.sigma_px,
    };
    let corners =
        indices.iter().zip(&fits).zip(is_usable).filter(|(_, usable)| *usable).map(|(pair, _)| corner(pair));
    BoardCorners { inner_columns, inner_rows, corners: corners.collect() }
}

/// Which corners of a partial board are as accurate as the others: next to an occlusion, windows contain little of the
/// board.
fn usable(indices: &[[usize; 2]], fits: &[fitting::fit::CornerFit]) -> Vec<bool> {
    let mut sigmas: Vec<f64> = fits.iter().map(|fit| fit.sigma_px).collect();
    let limit_px = PART_MAX_SIGMA_MEDIANS * median(&mut sigmas).unwrap_or_default();
    let agreeing = charuco::agreeing(indices, fits);
    agreeing.into_iter().zip(fits).map(|(agrees, fit)| agrees && fit.sigma_px <= limit_px).collect()
}

/// The first fits of all corners, row by row, if the lattice is the configured board.
fn board_from_lattice(
    lattice: &Lattice,
    params: &CornerParams,
) -> Result<Vec<fitting::fit::CornerFit>, CornerError> {
    let CornerParams { inner_columns, inner_rows } = *params;
    let needed = inner_columns * inner_rows;
    match read_board(lattice, inner_columns, inner_rows) {
        Board::Whole(first) => Ok(first),
        Board::Incomplete { found } => Err(CornerError::Incomplete { inner_columns, inner_rows, found, needed }),
        Board::OtherSize { columns, rows } => {
            Err(CornerError::WrongSize { inner_columns, inner_rows, found_columns: columns, found_rows: rows })
        }
    }
}

/// erf(x/√2) and exp(−x²/2).
fn erf_and_gauss(x: f64) -> (f64, f64) {
    (erf(x * FRAC_1_SQRT_2), (-0.5 * x * x).exp())
}
