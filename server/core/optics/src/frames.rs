//! Points and transforms typed by their frame.

use std::marker::PhantomData;
use std::ops::{Mul, Sub};

use nalgebra::{Matrix3, Rotation3, Vector3};

/// The camera: x right, y down, z forward, origin at the centre of projection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFrame;

/// The chessboard: x along its columns, y along its rows, z into the board; origin at corner (0, 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardFrame;

/// The part on the stage: the camera frame at stage position (angle) 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartFrame;

/// A point in millimetres in frame `F`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMm<F> {
    /// Coordinates.
    pub xyz: Vector3<f64>,
    frame: PhantomData<F>,
}

impl<F> PointMm<F> {
    /// A point from its coordinates.
    pub const fn new(xyz: Vector3<f64>) -> Self {
        Self { xyz, frame: PhantomData }
    }
}

/// The vector between two points of the same frame, mm.
impl<F> Sub for PointMm<F> {
    type Output = Vector3<f64>;

    fn sub(self, from: Self) -> Vector3<f64> {
        self.xyz - from.xyz
    }
}

/// A rigid transform from frame `From` to frame `To`; variables are named `to_from_from`, so that adjacent frames
/// cancel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid<To, From> {
    /// Rotation part.
    pub rotation: Rotation3<f64>,
    /// Position of the origin of `From` in `To`.
    pub translation_mm: Vector3<f64>,
    frames: PhantomData<(To, From)>,
}

impl<To, From> Rigid<To, From> {
    /// A motion from rotation and translation.
    pub fn new(rotation: Rotation3<f64>, translation_mm: Vector3<f64>) -> Self {
        Self { rotation, translation_mm, frames: PhantomData }
    }

    /// The identity.
    pub fn identity() -> Self {
        Self::new(Rotation3::identity(), Vector3::zeros())
    }

    /// The inverse motion.
    pub fn inverse(&self) -> Rigid<From, To> {
        let back = self.rotation.inverse();
        Rigid::new(back, -(back * self.translation_mm))
    }

    /// The rotation as a matrix whose columns are the axes of `From` in `To`.
    pub fn axes(&self) -> &Matrix3<f64> {
        self.rotation.matrix()
    }

    /// Moved by a small step: translation by the first three entries (mm, in `To`), rotation about the origin
    /// of `From` by the last three (radians, axes of `To`).
    pub fn stepped(&self, step: &[f64; 6]) -> Self {
        let turn = Rotation3::new(Vector3::new(step[3], step[4], step[5]));
        let rotation = orthonormal(&(turn * self.rotation));
        Self::new(rotation, self.translation_mm + Vector3::new(step[0], step[1], step[2]))
    }
}

/// Removes the rounding errors that accumulate in products of rotations, by one step of Newton's iteration for the
/// nearest rotation: R' = R (3·1 − RᵀR) / 2.
///
/// With RᵀR = 1 + E it gives R'ᵀR' = 1 − ¾E² + ¼E³. For a product of two rotations E is of the order of rounding, so
/// one step suffices.
fn orthonormal(rotation: &Rotation3<f64>) -> Rotation3<f64> {
    let matrix = rotation.matrix();
    let towards = Matrix3::from_diagonal_element(1.5) - matrix.tr_mul(matrix) * 0.5;
    Rotation3::from_matrix_unchecked(matrix * towards)
}

impl<To, From> Mul<PointMm<From>> for Rigid<To, From> {
    type Output = PointMm<To>;

    fn mul(self, point: PointMm<From>) -> PointMm<To> {
        PointMm::new(self.rotation * point.xyz + self.translation_mm)
    }
}

impl<To, Mid, From> Mul<Rigid<Mid, From>> for Rigid<To, Mid> {
    type Output = Rigid<To, From>;

    fn mul(self, first: Rigid<Mid, From>) -> Rigid<To, From> {
        Rigid::new(self.rotation * first.rotation, self.rotation * first.translation_mm + self.translation_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_and_its_inverse_cancel() {
        let camera_from_board: Rigid<CameraFrame, BoardFrame> =
            Rigid::new(Rotation3::new(Vector3::new(0.1, -0.4, 0.2)), Vector3::new(3.0, -2.0, 400.0));
        let round_trip = camera_from_board.inverse() * camera_from_board;
        let point = PointMm::<BoardFrame>::new(Vector3::new(12.0, 24.0, 0.0));
        assert!(((round_trip * point).xyz - point.xyz).norm() < 1e-12);
    }

    #[test]
    fn after_a_hundred_thousand_steps_a_rotation_is_still_orthonormal() {
        // Rounding of nine products of three terms each.
        const ROUNDING: f64 = 8.0 * f64::EPSILON;
        let mut pose: Rigid<CameraFrame, BoardFrame> = Rigid::identity();
        let mut worst: f64 = 0.0;
        for idx in 0..100_000 {
            let way = f64::from(idx);
            let turn = [way.sin(), (1.7 * way).cos(), (0.3 * way).sin()].map(|part| part * 10f64.powi(-(idx % 9)));
            pose = pose.stepped(&[0.0, 0.0, 0.0, turn[0], turn[1], turn[2]]);
            worst = worst.max((pose.axes().tr_mul(pose.axes()) - Matrix3::identity()).amax());
        }
        assert!(worst < ROUNDING, "{worst}");
        assert!((pose.axes().determinant() - 1.0).abs() < ROUNDING);
    }

    #[test]
    fn a_step_removes_accumulated_rounding() {
        let askew = Matrix3::identity() + Matrix3::new(1.0, 2.0, -1.0, 0.5, -2.0, 1.0, 3.0, 0.0, 1.0) * 1e-9;
        let pose: Rigid<CameraFrame, BoardFrame> =
            Rigid::new(Rotation3::from_matrix_unchecked(askew), Vector3::zeros());
        let axes = *pose.stepped(&[0.0; 6]).axes();
        assert!((axes.tr_mul(&axes) - Matrix3::identity()).amax() < 8.0 * f64::EPSILON);
    }
}
