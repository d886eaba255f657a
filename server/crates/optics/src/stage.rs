//! The stage: registration of camera points to the part, X_part = X_camera − s·t.

use nalgebra::Vector3;

use crate::frames::{CameraFrame, PartFrame, PointMm};

/// The stage's travel in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageAxis {
    /// t: how far the part moves in the camera frame per millimetre of nominal travel (mm/mm); its length
    /// differs from 1 by the stage's scale error.
    pub direction: Vector3<f64>,
}

impl StageAxis {
    /// A point seen by the camera at stage position `position_mm`, fixed to the part.
    pub fn part_from_camera(&self, hit_in_camera: &PointMm<CameraFrame>, position_mm: f64) -> PointMm<PartFrame> {
        PointMm::new(hit_in_camera.xyz - self.direction * position_mm)
    }
}
