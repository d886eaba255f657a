//! The calibration target: a printed pattern with a white margin in front of a backdrop.

use capture::Target;
use nalgebra::{Matrix3, Vector2, Vector3};
use optics::{Motion, PointMm};

use crate::params::BACKDROP_REFLECTANCE;
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
    pub(super) fn extent_steps(&self) -> Vector2<f64> {
        Vector2::new((self.print.steps_along_row() * self.inner_columns) as f64, self.inner_rows as f64)
    }

    /// Point on the board at so many steps from its first corner or disc.
    pub(super) fn place_mm(&self, steps: &Vector2<f64>) -> Vector2<f64> {
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
}
