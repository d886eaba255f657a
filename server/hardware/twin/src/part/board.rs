//! The calibration target: a chessboard with a white margin before a backdrop.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::params::{BACKDROP_REFLECTANCE, BLACK_REFLECTANCE, WHITE_REFLECTANCE};
use crate::part::scene::SceneHit;

/// A chessboard at rest. Its own frame: origin at its centre, x along its rows, y along its columns of squares, z into it;
/// the first square, at negative x and y, is black.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Inner corners along a row.
    pub inner_columns: usize,
    /// Inner corners along a column.
    pub inner_rows: usize,
    /// Side of a square; the white margin around the squares is as wide.
    pub square_mm: f64,
    /// Columns: the board's axes in the camera frame.
    pub axes: Matrix3<f64>,
    /// The centre in the camera frame.
    pub centre_mm: Vector3<f64>,
    /// Depth of the backdrop, a wall across the camera axis.
    pub backdrop_z_mm: f64,
}

impl Board {
    /// Half of what the squares cover along x and y.
    pub fn half_mm(&self) -> Vector2<f64> {
        Vector2::new(self.inner_columns as f64 + 1.0, self.inner_rows as f64 + 1.0) * (self.square_mm / 2.0)
    }

    /// Inner corner (column, row) in the camera frame.
    pub fn corner_mm(&self, column: usize, row: usize) -> Vector3<f64> {
        let at = |idx: usize, count: usize| (idx as f64 - (count as f64 - 1.0) / 2.0) * self.square_mm;
        self.centre_mm + self.axes * Vector3::new(at(column, self.inner_columns), at(row, self.inner_rows), 0.0)
    }

    /// The board moved in the camera frame.
    pub fn moved(&self, by_mm: &Vector3<f64>) -> Self {
        Self { centre_mm: self.centre_mm + by_mm, ..*self }
    }

    /// Where a ray meets the board's plane: reach, and the place on it.
    pub(crate) fn plane_hit(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<(f64, Vector2<f64>)> {
        let normal = self.axes.column(2);
        let reach = normal.dot(&(self.centre_mm - origin)) / normal.dot(direction);
        if !(reach.is_finite() && reach > 0.0) {
            return None;
        }
        let at = origin + direction * reach - self.centre_mm;
        Some((reach, Vector2::new(self.axes.column(0).dot(&at), self.axes.column(1).dot(&at))))
    }

    /// The board or the backdrop behind it.
    pub(crate) fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        if let Some((reach, at)) = self.plane_hit(origin, direction) {
            let edge = self.half_mm().add_scalar(self.square_mm);
            if at.x.abs() <= edge.x && at.y.abs() <= edge.y {
                let normal = -self.axes.column(2).into_owned();
                return Some(SceneHit { reach, normal, reflectance: self.reflectance(&at) });
            }
        }
        let reach = (self.backdrop_z_mm - origin.z) / direction.z;
        (reach.is_finite() && reach > 0.0).then_some(SceneHit {
            reach,
            normal: -Vector3::z(),
            reflectance: BACKDROP_REFLECTANCE,
        })
    }

    /// Reflectance at a point of the board.
    fn reflectance(&self, at: &Vector2<f64>) -> f64 {
        let cell = (at + self.half_mm()) / self.square_mm;
        let (column, row) = (cell.x.floor(), cell.y.floor());
        let inside =
            (0.0..=self.inner_columns as f64).contains(&column) && (0.0..=self.inner_rows as f64).contains(&row);
        if inside && (column + row).rem_euclid(2.0) < 0.5 { BLACK_REFLECTANCE } else { WHITE_REFLECTANCE }
    }

    /// Whether an edge passes within `reach` of a point (both along x and y, mm).
    pub(crate) fn edge_within(&self, at: &Vector2<f64>, reach: &Vector2<f64>) -> bool {
        (0..2).any(|axis| {
            let (half, square) = (self.half_mm()[axis], self.square_mm);
            let beyond = at[axis].abs() - half;
            let to_line = if beyond > 0.0 {
                beyond.min((beyond - square).abs())
            } else {
                let cells = (at[axis] + half) / square;
                let phase = cells - cells as i64 as f64;
                phase.min(1.0 - phase) * square
            };
            to_line < reach[axis]
        })
    }

    /// Reflectance averaged over a small parallelogram around `at` that spans `span` along x and y (mm), each edge
    /// blurred as if it crossed alone; and the share of the board itself, the rest being backdrop.
    ///
    /// The average is odd about every edge and every corner, so that neither moves.
    pub(crate) fn blurred_reflectance(&self, at: &Vector2<f64>, span: &Vector2<f64>) -> (f64, f64) {
        let (half, square) = (self.half_mm(), self.square_mm);
        let counts = [self.inner_columns as i64, self.inner_rows as i64];
        let (mut parity, mut squares, mut board) = (1.0, 1.0, 1.0);
        for axis in 0..2 {
            let step = |distance: f64| (distance / span[axis] + 0.5).clamp(0.0, 1.0);
            // The nearest inner line; casts round towards zero, and what lies outside is held at the first or last.
            let line = (((at[axis] + half[axis]) / square + 0.5) as i64).clamp(1, counts[axis]);
            let side = 2.0 * step(at[axis] + half[axis] - line as f64 * square) - 1.0;
            parity *= if line & 1 == 0 { side } else { -side };
            squares *= step(half[axis] - at[axis].abs());
            board *= step(half[axis] + square - at[axis].abs());
        }
        let black = squares * (1.0 + parity) / 2.0;
        (WHITE_REFLECTANCE + (BLACK_REFLECTANCE - WHITE_REFLECTANCE) * black, board)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Board {
        Board {
            inner_columns: 11,
            inner_rows: 8,
            square_mm: 12.0,
            axes: Matrix3::identity(),
            centre_mm: Vector3::new(0.0, 0.0, 400.0),
            backdrop_z_mm: 500.0,
        }
    }

    #[test]
    fn the_blurred_pattern_agrees_with_the_sharp_one_away_from_edges() {
        let (board, span) = (board(), Vector2::new(0.2, 0.2));
        for (x, y) in
            [(-66.0, -48.0), (-66.0, -36.0), (66.0, 48.0), (5.0, 1.0), (-77.0, 3.0), (1.0, 60.0), (61.0, -47.0)]
        {
            let at = Vector2::new(x, y);
            assert!(!board.edge_within(&at, &span));
            let (reflectance, share) = board.blurred_reflectance(&at, &span);
            assert!((reflectance - board.reflectance(&at)).abs() < 1e-12 && share == 1.0, "{x} {y}");
        }
    }

    #[test]
    fn the_first_square_is_black() {
        assert_eq!(board().reflectance(&Vector2::new(-66.0, -48.0)), BLACK_REFLECTANCE);
        assert_eq!(board().reflectance(&Vector2::new(-54.0, -48.0)), WHITE_REFLECTANCE);
    }
}
