//! The calibration target: a printed pattern with a white margin in front of a backdrop.

use capture::Target;
use nalgebra::{Matrix3, Vector2, Vector3};
use optics::{Motion, PointMm};

use crate::params::{BACKDROP_REFLECTANCE, BLACK_REFLECTANCE, WHITE_REFLECTANCE};
use crate::part::print::Print;
use crate::part::scene::SceneHit;

/// A calibration target at rest. Its frame: origin at its centre, x along its rows, y along its columns, z into it; the
/// first square or disc, at negative x and y, is black.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// Inner corners, or discs, along a row.
    pub inner_columns: usize,
    /// Inner corners, or discs, along a column.
    pub inner_rows: usize,
    /// Side of a square, or step of a grid of discs, along x and y; the white margin around the pattern has the same
    /// width.
    pub square_mm: Vector2<f64>,
    /// The printed pattern.
    pub print: Print,
    /// Columns: the board's axes in the camera frame.
    pub axes: Matrix3<f64>,
    /// The centre in the camera frame.
    pub centre_mm: Vector3<f64>,
    /// Depth of the backdrop, a wall perpendicular to the camera axis.
    pub backdrop_z_mm: f64,
}

impl Board {
    /// The target as printed, on the camera axis at the camera.
    pub fn of(target: &Target) -> Self {
        let (inner_columns, inner_rows) = target.inner_corners();
        let square = target.square_mm();
        Self {
            inner_columns,
            inner_rows,
            square_mm: Vector2::new(square.x_mm, square.y_mm),
            print: Print::of(target),
            axes: Matrix3::identity(),
            centre_mm: Vector3::zeros(),
            backdrop_z_mm: f64::INFINITY,
        }
    }

    /// Half of the pattern's size along x and y, including half a step around discs.
    pub fn half_mm(&self) -> Vector2<f64> {
        let beyond = if matches!(self.print, Print::Discs { .. }) { 0.0 } else { 1.0 };
        (self.extent_steps().add_scalar(beyond)).component_mul(&self.square_mm) / 2.0
    }

    /// Inner corner, or centre of a disc, (column, row) in the camera frame.
    pub fn corner_mm(&self, column: usize, row: usize) -> Vector3<f64> {
        let along_row = self.print.steps_along_row();
        let steps = if along_row == 2 { 2 * column + row % 2 } else { column };
        let at = self.place_mm(&Vector2::new(steps as f64, row as f64));
        self.centre_mm + self.axes * Vector3::new(at.x, at.y, 0.0)
    }

    /// Points of the grid along x and y, including the empty ones of a staggered grid.
    fn extent_steps(&self) -> Vector2<f64> {
        Vector2::new((self.print.steps_along_row() * self.inner_columns) as f64, self.inner_rows as f64)
    }

    /// Point on the board at so many steps from its first corner or disc.
    fn place_mm(&self, steps: &Vector2<f64>) -> Vector2<f64> {
        (steps - (self.extent_steps().add_scalar(-1.0)) / 2.0).component_mul(&self.square_mm)
    }

    /// Numbers that identify its pattern; a plain chessboard needs only its counts and one side.
    pub(crate) fn pattern_numbers(&self) -> Vec<f64> {
        let mut numbers = vec![self.inner_columns as f64, self.inner_rows as f64, self.square_mm.x];
        if self.square_mm.y != self.square_mm.x {
            numbers.push(self.square_mm.y);
        }
        match &self.print {
            Print::Squares => {}
            Print::Markers(markers) => numbers.extend([2.0, markers.fraction()]),
            Print::Discs { diameter_mm, .. } => {
                numbers.extend([2.0 + self.print.steps_along_row() as f64, *diameter_mm]);
            }
        }
        numbers
    }

    /// The board translated in the camera frame.
    pub fn moved(&self, by_mm: &Vector3<f64>) -> Self {
        Self { centre_mm: self.centre_mm + by_mm, ..self.clone() }
    }

    /// The board after a motion of the stage.
    pub fn turned(&self, motion: &Motion) -> Self {
        let axis = |axis| motion.camera_direction(&self.axes.column(axis).into_owned());
        Self {
            axes: Matrix3::from_columns(&[0, 1, 2].map(axis)),
            centre_mm: motion.camera_from_part(&PointMm::new(self.centre_mm)).xyz,
            ..self.clone()
        }
    }

    /// Intersection of a ray with the board's plane: ray length and point on the plane.
    pub(crate) fn plane_hit(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<(f64, Vector2<f64>)> {
        let normal = self.axes.column(2);
        let ray_length = normal.dot(&(self.centre_mm - origin)) / normal.dot(direction);
        if !(ray_length.is_finite() && ray_length > 0.0) {
            return None;
        }
        let at = origin + direction * ray_length - self.centre_mm;
        Some((ray_length, Vector2::new(self.axes.column(0).dot(&at), self.axes.column(1).dot(&at))))
    }

    /// Intersection with the board or the backdrop behind it.
    pub(crate) fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        if let Some((ray_length, at)) = self.plane_hit(origin, direction) {
            let edge = self.half_mm() + self.square_mm;
            if at.x.abs() <= edge.x && at.y.abs() <= edge.y {
                let normal = -self.axes.column(2).into_owned();
                return Some(SceneHit { ray_length, normal, reflectance: self.reflectance(&at) });
            }
        }
        let ray_length = (self.backdrop_z_mm - origin.z) / direction.z;
        (ray_length.is_finite() && ray_length > 0.0).then_some(SceneHit {
            ray_length,
            normal: -Vector3::z(),
            reflectance: BACKDROP_REFLECTANCE,
        })
    }

    /// Reflectance at a point of the board.
    pub(crate) fn reflectance(&self, at: &Vector2<f64>) -> f64 {
        let (mean, _) = self.blurred_reflectance(at, &Vector2::repeat(f64::MIN_POSITIVE));
        if mean < (BLACK_REFLECTANCE + WHITE_REFLECTANCE) / 2.0 { BLACK_REFLECTANCE } else { WHITE_REFLECTANCE }
    }

    /// Whether an edge passes within `margin` of a point (both along x and y, mm).
    pub(crate) fn edge_within(&self, at: &Vector2<f64>, margin: &Vector2<f64>) -> bool {
        let outside = at.abs() - self.half_mm();
        if (0..2).any(|axis| (outside[axis] - self.square_mm[axis]).abs() < margin[axis]) {
            return true;
        }
        match &self.print {
            Print::Discs { diameter_mm, .. } => {
                (self.beside_disc_mm(at).norm() - diameter_mm / 2.0).abs() < margin.norm()
            }
            Print::Squares => self.square_edge_within(at, margin),
            Print::Markers(markers) => {
                let squares = margin.component_div(&self.square_mm);
                self.square_edge_within(at, margin) || markers.is_near(&self.in_squares(at), &squares)
            }
        }
    }

    fn square_edge_within(&self, at: &Vector2<f64>, margin: &Vector2<f64>) -> bool {
        let cells = self.in_squares(at);
        (0..2).any(|axis| {
            let beyond = at[axis].abs() - self.half_mm()[axis];
            let phase = cells[axis] - cells[axis] as i64 as f64;
            let to_line = if beyond > 0.0 { beyond } else { phase.min(1.0 - phase) * self.square_mm[axis] };
            to_line < margin[axis]
        })
    }

    /// A point in squares from the top left of the pattern.
    fn in_squares(&self, at: &Vector2<f64>) -> Vector2<f64> {
        (at + self.half_mm()).component_div(&self.square_mm)
    }

    /// Vector from the centre of the nearest disc to a point, mm.
    fn beside_disc_mm(&self, at: &Vector2<f64>) -> Vector2<f64> {
        let along_row = self.print.steps_along_row() as f64;
        let steps = at.component_div(&self.square_mm) + (self.extent_steps().add_scalar(-1.0)) / 2.0;
        let in_row = |row: f64| {
            let row = row.clamp(0.0, self.inner_rows as f64 - 1.0);
            let first = row.rem_euclid(along_row);
            let column = ((steps.x - first) / along_row).round().clamp(0.0, self.inner_columns as f64 - 1.0);
            at - self.place_mm(&Vector2::new(first + along_row * column, row))
        };
        let (above, below) = (in_row(steps.y.floor()), in_row(steps.y.ceil()));
        if above.norm_squared() < below.norm_squared() { above } else { below }
    }

    /// Reflectance averaged over a small parallelogram around `at` that spans `span` along x and y (mm), each edge
    /// blurred as if it were the only one; and the fraction covered by the board, the rest being backdrop.
    ///
    /// The average is odd about every edge and every corner, so that neither moves.
    pub(crate) fn blurred_reflectance(&self, at: &Vector2<f64>, span: &Vector2<f64>) -> (f64, f64) {
        let outer = self.half_mm() + self.square_mm - at.abs();
        let board = step(outer.x, span.x) * step(outer.y, span.y);
        let black = match &self.print {
            Print::Squares => self.black_by_squares(at, span),
            Print::Markers(markers) => {
                let cells = span.component_div(&self.square_mm);
                self.black_by_squares(at, span) + markers.black_fraction(&self.in_squares(at), &cells)
            }
            Print::Discs { diameter_mm, .. } => {
                let from_centre = self.beside_disc_mm(at);
                let distance = from_centre.norm().max(f64::MIN_POSITIVE);
                step(diameter_mm / 2.0 - distance, from_centre.abs().dot(span) / distance)
            }
        };
        (WHITE_REFLECTANCE + (BLACK_REFLECTANCE - WHITE_REFLECTANCE) * black, board)
    }

    /// Fraction of a small parallelogram that is covered by black squares.
    fn black_by_squares(&self, at: &Vector2<f64>, span: &Vector2<f64>) -> f64 {
        let (half, counts) = (self.half_mm(), [self.inner_columns as i64, self.inner_rows as i64]);
        let (mut parity, mut squares) = (1.0, 1.0);
        for axis in 0..2 {
            let square = self.square_mm[axis];
            // The nearest inner line; casts round towards zero, and points outside are clamped to the first or last
            // line.
            let line = (((at[axis] + half[axis]) / square + 0.5) as i64).clamp(1, counts[axis]);
            let side = 2.0 * step(at[axis] + half[axis] - line as f64 * square, span[axis]) - 1.0;
            parity *= if line & 1 == 0 { side } else { -side };
            squares *= step(half[axis] - at[axis].abs(), span[axis]);
        }
        squares * (1.0 + parity) / 2.0
    }
}

/// An edge averaged over `span`: 0 before it, 1 behind it.
fn step(distance: f64, span: f64) -> f64 {
    (distance / span + 0.5).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use capture::{CharucoTarget, ChessboardTarget, CirclesTarget};

    use super::*;

    fn board() -> Board {
        Board::of(&ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: 12.0.into() }.into())
    }

    #[test]
    fn the_blurred_pattern_agrees_with_the_sharp_one_away_from_edges() {
        let (board, span) = (board(), Vector2::new(0.2, 0.2));
        for (x, y) in
            [(-66.0, -48.0), (-66.0, -36.0), (66.0, 48.0), (5.0, 1.0), (-77.0, 3.0), (1.0, 60.0), (61.0, -47.0)]
        {
            let at = Vector2::new(x, y);
            assert!(!board.edge_within(&at, &span));
            let (reflectance, fraction) = board.blurred_reflectance(&at, &span);
            assert!((reflectance - board.reflectance(&at)).abs() < 1e-12 && fraction == 1.0, "{x} {y}");
        }
    }

    #[test]
    fn the_first_square_is_black() {
        assert_eq!(board().reflectance(&Vector2::new(-66.0, -48.0)), BLACK_REFLECTANCE);
        assert_eq!(board().reflectance(&Vector2::new(-54.0, -48.0)), WHITE_REFLECTANCE);
    }

    #[test]
    fn every_edge_of_every_pattern_is_detected() {
        let sides = capture::SquareMm { x_mm: 12.0, y_mm: 13.0 };
        let grid = CirclesTarget { columns: 4, rows: 11, square_mm: sides, diameter_mm: 9.0 };
        let dictionary = "DICT_4X4_50".to_owned();
        let markers = CharucoTarget { columns: 8, rows: 6, square_mm: sides, marker_mm: 8.0, dictionary };
        for target in [
            Target::Circles(grid.clone()),
            Target::AsymmetricCircles(grid),
            Target::Charuco(markers),
            ChessboardTarget { inner_columns: 7, inner_rows: 5, square_mm: sides }.into(),
        ] {
            let (board, span) = (Board::of(&target), Vector2::new(0.2, 0.3));
            let edge = board.half_mm() + board.square_mm + Vector2::repeat(1.0);
            let mut n_edges = 0;
            for (x, y) in (-200..200).flat_map(|x| (-200..200).map(move |y| (x, y))) {
                let at = Vector2::new(f64::from(x) / 200.0 * edge.x, f64::from(y) / 200.0 * edge.y);
                let (blurred, fraction) = board.blurred_reflectance(&at, &span);
                let is_plain =
                    [BLACK_REFLECTANCE, WHITE_REFLECTANCE].iter().any(|one| (blurred - one).abs() < 1e-12);
                let is_mixed = !is_plain || (fraction != 0.0 && fraction != 1.0);
                n_edges += usize::from(is_mixed);
                assert!(!is_mixed || board.edge_within(&at, &span), "{target:?} {at}");
            }
            assert!(n_edges > 500, "{target:?} {n_edges}");
        }
    }

    #[test]
    fn discs_are_black_around_their_centres_and_nowhere_else() {
        for staggered in [false, true] {
            let grid = CirclesTarget { columns: 4, rows: 5, square_mm: 15.0.into(), diameter_mm: 10.0 };
            let target = if staggered { Target::AsymmetricCircles(grid) } else { Target::Circles(grid) };
            let board = Board::of(&target);
            for (column, row) in (0..4).flat_map(|column| (0..5).map(move |row| (column, row))) {
                let centre = board.corner_mm(column, row).xy();
                assert_eq!(board.reflectance(&(centre + Vector2::new(3.4, 3.4))), BLACK_REFLECTANCE);
                assert_eq!(board.reflectance(&(centre + Vector2::new(-3.6, 3.6))), WHITE_REFLECTANCE);
                let rim = centre + Vector2::new(0.0, 5.0);
                let (half, _) = board.blurred_reflectance(&rim, &Vector2::repeat(0.1));
                assert!((half - (BLACK_REFLECTANCE + WHITE_REFLECTANCE) / 2.0).abs() < 1e-9, "{half}");
            }
        }
    }
}
