//! The printed pattern of a calibration target.

use std::sync::Arc;

use capture::Target;
use nalgebra::Vector2;
use vision::CharucoParams;

use crate::arithmetic::floor;

/// The printed pattern of a target.
#[derive(Debug, Clone, PartialEq)]
pub enum Print {
    /// Squares, the first one black.
    Squares,
    /// Squares, with markers in the white ones.
    Markers(Arc<Markers>),
    /// Black discs around the grid's points.
    Discs {
        /// Whether every other row is shifted by a step, and the discs of a row are two steps apart.
        staggered: bool,
        /// Diameter of a disc.
        diameter_mm: f64,
    },
}

/// The markers of a ChArUco board, numbered row by row.
#[derive(Debug, PartialEq)]
pub struct Markers {
    /// Squares along a row of the board.
    columns: usize,
    /// Side of a marker over the side of a square.
    fraction: f64,
    /// The cells of each marker, row by row: true where black.
    cells: Vec<Vec<Vec<bool>>>,
}

impl Print {
    /// The pattern of `target`. A marker missing from its dictionary is left white.
    pub(crate) fn of(target: &Target) -> Self {
        match target {
            Target::Chessboard(_) => Self::Squares,
            Target::Charuco(board) => {
                let square = board.square_mm;
                let fraction = board.marker_mm / square.x_mm.min(square.y_mm);
                let params = CharucoParams {
                    columns: board.columns,
                    rows: board.rows,
                    marker_ratio: fraction,
                    dictionary: board.dictionary.clone(),
                };
                let cells = (0..board.columns * board.rows / 2).map_while(|id| params.marker_cells(id));
                Self::Markers(Arc::new(Markers { columns: board.columns, fraction, cells: cells.collect() }))
            }
            Target::Circles(grid) => Self::Discs { staggered: false, diameter_mm: grid.diameter_mm },
            Target::AsymmetricCircles(grid) => Self::Discs { staggered: true, diameter_mm: grid.diameter_mm },
        }
    }

    /// Steps of the grid from one disc of a row, or from one corner, to the next.
    pub(crate) fn steps_along_row(&self) -> usize {
        if matches!(self, Self::Discs { staggered: true, .. }) { 2 } else { 1 }
    }
}

impl Markers {
    /// Side of a marker over the side of a square.
    pub(crate) fn fraction(&self) -> f64 {
        self.fraction
    }

    /// Fraction of a small rectangle around `at` (squares from the top left of the board) that is covered by black
    /// cells of a marker.
    pub(crate) fn black_fraction(&self, at: &Vector2<f64>, span: &Vector2<f64>) -> f64 {
        let Some(cells) = self.marker_at(at) else { return 0.0 };
        let n = cells.len() as f64;
        let rim = 0.5 * (1.0 - self.fraction);
        let overlaps = [0, 1].map(|axis| {
            let middle = ((at[axis] - floor(at[axis])) - rim) / self.fraction * n;
            overlaps(middle, span[axis] / self.fraction * n)
        });
        let black = |x: f64, y: f64| {
            let inside = |idx: f64| (0.0..n).contains(&idx);
            inside(x) && inside(y) && cells[y as usize][x as usize]
        };
        let [across, down] = overlaps;
        let pairs = down.iter().flat_map(|row| across.iter().map(move |column| (column, row)));
        pairs.filter(|((x, _), (y, _))| black(*x, *y)).map(|((_, a), (_, b))| a * b).sum()
    }

    /// Whether a marker is within `margin` (squares) of `at`.
    pub(crate) fn is_near(&self, at: &Vector2<f64>, margin: &Vector2<f64>) -> bool {
        let rim = 0.5 * (1.0 - self.fraction);
        self.marker_at(at).is_some()
            && (0..2).all(|axis| {
                let within = at[axis] - floor(at[axis]);
                (rim - margin[axis]..=1.0 - rim + margin[axis]).contains(&within)
            })
    }

    /// The cells of the marker in the square at a point.
    fn marker_at(&self, at: &Vector2<f64>) -> Option<&Vec<Vec<bool>>> {
        let (column, row) = (floor(at.x), floor(at.y));
        let is_white = column + row - 2.0 * floor((column + row) / 2.0) > 0.5;
        if !is_white || column < 0.0 || row < 0.0 || column >= self.columns as f64 {
            return None;
        }
        // Every other square before this one is white.
        self.cells.get((row as usize * self.columns + column as usize) / 2)
    }
}

/// The cells overlapped by an interval no longer than one, each with its fraction of the interval.
fn overlaps(middle: f64, length: f64) -> [(f64, f64); 2] {
    let (low, high) = (middle - length / 2.0, middle + length / 2.0);
    let (first, last) = (floor(low), floor(high));
    if first == last {
        return [(first, 1.0), (last, 0.0)];
    }
    let beyond = (high - last) / length;
    [(first, 1.0 - beyond), (last, beyond)]
}

#[cfg(test)]
mod tests {
    use capture::CharucoTarget;

    use super::*;

    #[test]
    fn a_marker_shows_its_cells_in_the_white_squares() {
        let dictionary = "DICT_4X4_50".to_owned();
        let target = Target::Charuco(CharucoTarget {
            columns: 5,
            rows: 4,
            square_mm: 10.0.into(),
            marker_mm: 6.0,
            dictionary: dictionary.clone(),
        });
        let Print::Markers(markers) = Print::of(&target) else { panic!("a board with markers") };
        let params = CharucoParams { columns: 5, rows: 4, marker_ratio: 0.6, dictionary };
        let span = Vector2::repeat(1e-6);
        // White squares in order: (1, 0), (3, 0), (0, 1), (2, 1), (4, 1), (1, 2) …
        for (id, (column, row)) in [(1, 0), (3, 0), (0, 1), (2, 1), (4, 1), (1, 2)].into_iter().enumerate() {
            let cells = params.marker_cells(id).unwrap();
            for (y, x) in (0..6).flat_map(|y| (0..6).map(move |x| (y, x))) {
                let at = |idx: usize, square: i32| f64::from(square) + 0.2 + 0.1 * (idx as f64 + 0.5);
                let place = Vector2::new(at(x, column), at(y, row));
                assert_eq!(
                    markers.black_fraction(&place, &span),
                    f64::from(u8::from(cells[y][x])),
                    "{id} {x} {y}"
                );
            }
        }
        // Outer edge of the border: half of the rectangle is on it.
        let edge = markers.black_fraction(&Vector2::new(1.2, 0.5), &Vector2::repeat(0.01));
        assert!((edge - 0.5).abs() < 1e-9, "{edge}");
        assert_eq!(markers.black_fraction(&Vector2::new(1.1, 0.5), &span), 0.0);
    }
}
