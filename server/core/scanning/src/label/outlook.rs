//! How a scan looks at the part: one view in which places and depths of all frames can be compared.

use nalgebra::{Vector2, Vector3};

use super::patches::ViewPoint;
use crate::params::SAMPLE_STRIDE_PX;

/// The view from the middle of the scan.
#[derive(Debug, Clone, Copy)]
pub struct Outlook {
    /// From the part frame to the camera in the middle of the scan: add this.
    pub middle_shift_mm: Vector3<f64>,
    /// Depth at which distances across the view are measured.
    pub reference_depth_mm: f64,
    /// Travel per frame as the camera sees it in (x, y), mm; zero if the stage does not move across the view.
    pub step_mm: Vector2<f64>,
    /// Width of a scan column (row) at the reference depth, mm.
    pub column_mm: f64,
    /// Smallest difference between two orders that counts, mm.
    pub floor_mm: f64,
}

impl Outlook {
    /// A point of the part as seen from the middle of the scan.
    pub fn view_of(&self, in_part_mm: &Vector3<f64>) -> ViewPoint {
        self.seen_from(&self.middle_shift_mm, in_part_mm)
    }

    /// A point of the part as seen while the stage has moved it by `shift_mm`.
    pub fn seen_from(&self, shift_mm: &Vector3<f64>, in_part_mm: &Vector3<f64>) -> ViewPoint {
        let seen = in_part_mm + shift_mm;
        ViewPoint { xy_mm: seen.xy() * (self.reference_depth_mm / seen.z), depth_mm: seen.z }
    }

    /// Every how many frames a line is asked: steps much finer than the samples along the line add nothing.
    pub fn frame_stride(&self) -> usize {
        let sample_mm = self.column_mm * SAMPLE_STRIDE_PX as f64;
        ((sample_mm / 4.0 / self.step_mm.norm()) as usize).max(1)
    }
}
