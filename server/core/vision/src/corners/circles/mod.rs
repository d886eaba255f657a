//! The centres of a grid of discs, with sub-pixel positions and standard deviations.
//!
//! 1. `blobs`: elliptic blobs of one polarity.
//! 2. `grid`: which of them form the configured grid, and which is row 0, column 0.
//! 3. `disc`: a blurred ellipse fitted to each.
//! 4. `eccentricity`: from the ellipse's centre to the image of the disc's centre.

mod blobs;
mod disc;
mod eccentricity;
mod grid;

use rayon::prelude::*;

use crate::GreyImage;

use super::params::{BLOB_WINDOW_DIVISORS, CIRCLES_MIN};
use super::{BoardCorners, Corner, CornerError};
use blobs::{Blob, Polarity, find_blobs};
use disc::fit_disc;
use eccentricity::to_disc_centres;
use grid::find_grid;

/// A grid of discs, dark on bright or bright on dark.
#[derive(Debug, Clone, PartialEq)]
pub struct CircleParams {
    /// Discs in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Whether every other row is shifted by half the spacing of the discs in a row, and rows are half that spacing
    /// apart, as in OpenCV's asymmetric grid.
    pub staggered: bool,
}

impl CircleParams {
    /// Position of a disc in grid steps: disc spacings, or half of them for a staggered grid.
    pub(super) fn place(&self, column: usize, row: usize) -> [i32; 2] {
        if self.staggered { [(2 * column + row % 2) as i32, row as i32] } else { [column as i32, row as i32] }
    }

    /// Every (column, row), row by row.
    pub(super) fn indices(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| [column, row]))
    }
}

/// Finds the centres of the configured grid of discs.
///
/// Positions are the images of the discs' centres in raw (distorted) pixels: perspective and distortion shift an
/// ellipse's own centre, which is corrected from the grid itself. Columns × rows have the same handedness as u × v. A
/// symmetric grid, and a staggered one with an even number of rows, look the same after a rotation by 180°: their
/// columns run as nearly as possible towards +u. Typical error per axis 0.004 px for discs of 25 px, a blur of 0.8 px
/// and 2 % noise.
///
/// # Errors
/// [`CornerError::NoCircles`] unless the whole grid is visible.
pub fn find_circles(image: &GreyImage, params: &CircleParams) -> Result<BoardCorners, CornerError> {
    let (columns, rows) = (params.columns, params.rows);
    let mut found = 0;
    for polarity in [Polarity::Dark, Polarity::Bright] {
        for divisor in BLOB_WINDOW_DIVISORS {
            let radius_px = (image.width().max(image.height()) / divisor).max(4);
            let blobs = find_blobs(image, polarity, radius_px);
            if blobs.len() < CIRCLES_MIN {
                continue;
            }
            match find_grid(&blobs, params) {
                Ok(grid) => match measured(image, params, &grid) {
                    Some(board) => return Ok(board),
                    None => found = found.max(grid.len() - 1),
                },
                Err(largest) => found = found.max(largest),
            }
        }
    }
    Err(CornerError::NoCircles { columns, rows, found: found.min(columns * rows - 1) })
}

/// Fits every disc; `None` if one of them is not a disc.
fn measured(image: &GreyImage, params: &CircleParams, grid: &[Blob]) -> Option<BoardCorners> {
    let nearest_px = |k: usize| {
        let others = grid.iter().enumerate().filter(|(other, _)| *other != k);
        others.map(|(_, blob)| blob.distance_px(&grid[k])).fold(f64::INFINITY, f64::min)
    };
    let discs: Option<Vec<_>> =
        (0..grid.len()).into_par_iter().map(|k| fit_disc(image, &grid[k], nearest_px(k))).collect();
    let discs = discs?;
    let places: Vec<[f64; 2]> =
        params.indices().map(|[column, row]| params.place(column, row).map(f64::from)).collect();
    let centres = to_disc_centres(&discs, &places)?;
    let corner = |((index, disc), centre): (([usize; 2], &disc::Disc), [f64; 2])| Corner {
        row: index[1],
        column: index[0],
        u_px: centre[0],
        v_px: centre[1],
        sigma_px: disc.sigma_px,
    };
    let corners = params.indices().zip(&discs).zip(centres).map(corner).collect();
    Some(BoardCorners { inner_columns: params.columns, inner_rows: params.rows, corners })
}
