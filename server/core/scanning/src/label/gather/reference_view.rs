//! The reference view of a scan, in which positions and depths of all frames are compared.

use std::ops::RangeInclusive;

use nalgebra::{Vector2, Vector3};

use super::patches::ViewPoint;
use crate::input::motions::{Chart, FrameMotion};
use crate::params::{PATCH_RADIUS_RELATIVE, SAMPLE_STRIDE_PX};

/// The view from the middle of the scan.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceView {
    /// Chart in which positions of all frames are compared.
    pub chart: Chart,
    /// Shift from the part frame to the camera frame in the middle of the scan.
    pub middle_shift_mm: Vector3<f64>,
    /// Depth at which distances across the view are measured.
    pub reference_depth_mm: f64,
    /// Travel per frame in the camera's (x, y), mm; zero if the stage does not move across the view.
    pub step_mm: Vector2<f64>,
    /// Width of a scan column (row) at the reference depth, mm.
    pub column_mm: f64,
    /// Smallest significant difference between two orders, mm.
    pub floor_mm: f64,
}

impl ReferenceView {
    /// A point of the part as viewed from the middle of the scan.
    pub fn view_of(&self, in_part_mm: &Vector3<f64>) -> ViewPoint {
        view_point(&self.chart.view_of(in_part_mm, &self.middle_shift_mm, self.reference_depth_mm))
    }

    /// The same, with its repetitions one turn earlier and later on a turntable.
    pub fn views_of(&self, in_part_mm: &Vector3<f64>) -> impl Iterator<Item = ViewPoint> + use<> {
        let most = if self.chart.period_mm().is_some() { MAX_TURNS } else { 0 };
        self.views_after(in_part_mm, -most..=most)
    }

    /// A point of the part as viewed one or more turns earlier.
    pub fn views_a_turn_before(&self, in_part_mm: &Vector3<f64>) -> impl Iterator<Item = ViewPoint> + use<> {
        // Positions in later frames have a smaller y.
        self.views_after(in_part_mm, 1..=MAX_TURNS)
    }

    fn views_after(
        &self,
        in_part_mm: &Vector3<f64>,
        turns: RangeInclusive<i32>,
    ) -> impl Iterator<Item = ViewPoint> + use<> {
        let view = self.view_of(in_part_mm);
        let period_mm = self.chart.period_mm().unwrap_or(0.0);
        turns.map(move |turn| match turn {
            0 => view,
            _ => {
                let xy_mm = Vector2::new(view.xy_mm.x, view.xy_mm.y + period_mm * f64::from(turn));
                ViewPoint { xy_mm, ..view }
            }
        })
    }

    /// A point of the part as viewed by the camera in a frame.
    pub fn seen_from(&self, frame: &FrameMotion, in_part_mm: &Vector3<f64>) -> ViewPoint {
        view_point(&frame.seen_from(in_part_mm, self.reference_depth_mm))
    }

    /// Largest curvature allowed for when a patch of surface is extended.
    pub fn curvature_per_mm(&self) -> f64 {
        1.0 / (PATCH_RADIUS_RELATIVE * self.reference_depth_mm)
    }

    /// Stride of the frames that are sampled: steps much finer than the samples along the line add no information.
    pub fn frame_stride(&self) -> usize {
        let sample_mm = self.column_mm * SAMPLE_STRIDE_PX as f64;
        ((sample_mm / 4.0 / self.step_mm.norm()) as usize).max(1)
    }
}

/// Most turns between two observations of one point: scans rarely have more turns.
const MAX_TURNS: i32 = 2;

fn view_point(seen: &Vector3<f64>) -> ViewPoint {
    ViewPoint { xy_mm: seen.xy(), depth_mm: seen.z }
}
