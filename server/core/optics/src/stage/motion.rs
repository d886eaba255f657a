//! The rigid motion of the part in one frame.

use nalgebra::{Rotation3, Vector3};

use crate::frames::{CameraFrame, PartFrame, PointMm};

/// Motion of the part from stage position 0: X_camera = R·X_part + shift, with R = 1 for a linear stage
/// that does not tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    shift_mm: Vector3<f64>,
    turn: Option<Rotation3<f64>>,
}

impl Motion {
    /// The identity.
    pub fn identity() -> Self {
        Self::translation(Vector3::zeros())
    }

    /// A translation by `shift_mm`, camera frame.
    pub fn translation(shift_mm: Vector3<f64>) -> Self {
        Self { shift_mm, turn: None }
    }

    /// A rotation by `turn` about `point_mm`, camera frame.
    pub fn rotation_about(turn: Rotation3<f64>, point_mm: &Vector3<f64>) -> Self {
        Self { shift_mm: point_mm - turn * point_mm, turn: Some(turn) }
    }

    /// This motion followed by a translation by `shift_mm`, camera frame.
    #[must_use]
    pub fn then_by(self, shift_mm: &Vector3<f64>) -> Self {
        Self { shift_mm: self.shift_mm + shift_mm, ..self }
    }

    /// This motion of a part that has been translated by `shift_mm` before.
    #[must_use]
    pub fn after(self, shift_mm: &Vector3<f64>) -> Self {
        Self { shift_mm: self.shift_mm + self.camera_direction(shift_mm), ..self }
    }

    /// Position of the part's origin, camera frame.
    pub fn shift_mm(&self) -> &Vector3<f64> {
        &self.shift_mm
    }

    /// A camera-frame point in the part frame.
    #[inline]
    pub fn part_from_camera(&self, in_camera: &PointMm<CameraFrame>) -> PointMm<PartFrame> {
        let back = in_camera.xyz - self.shift_mm;
        PointMm::new(match &self.turn {
            None => back,
            Some(turn) => turn.inverse_transform_vector(&back),
        })
    }

    /// A part-frame point in the camera frame.
    #[inline]
    pub fn camera_from_part(&self, in_part: &PointMm<PartFrame>) -> PointMm<CameraFrame> {
        PointMm::new(match &self.turn {
            None => in_part.xyz + self.shift_mm,
            Some(turn) => turn * in_part.xyz + self.shift_mm,
        })
    }

    /// A part-frame direction in the camera frame.
    #[inline]
    pub fn camera_direction(&self, in_part: &Vector3<f64>) -> Vector3<f64> {
        self.turn.map_or(*in_part, |turn| turn * in_part)
    }

    /// A camera-frame direction in the part frame.
    #[inline]
    pub fn part_direction(&self, in_camera: &Vector3<f64>) -> Vector3<f64> {
        self.turn.map_or(*in_camera, |turn| turn.inverse_transform_vector(in_camera))
    }
}
