//! The motion of the part in every frame, and the chart in which surfaces are compared.
//!
//! On a linear stage the camera observes the part from one side: the chart is the part frame. On a turntable it
//! observes all sides: the chart is unrolled about the axis (`docs/maths/turntable.md`, eq. 10).

use std::f64::consts::TAU;

use nalgebra::{Vector2, Vector3};
use optics::{CameraFrame, DepthRangeMm, Motion, PointMm, RotaryAxis, Stage, StagePosition};

/// One frame's motion.
#[derive(Debug, Clone, Copy)]
pub struct FrameMotion {
    motion: Motion,
    chart: Chart,
    /// Angle of a turntable.
    angle_rad: f64,
}

/// Coordinates (x, y, z) in which surfaces are compared: z is depth, (x, y) across the view.
#[derive(Debug, Clone, Copy)]
pub enum Chart {
    /// The part frame.
    Part,
    /// Unrolled about an axis.
    Unrolled(Unrolled),
}

/// The part unrolled about the axis of a turntable: x along the axis, y along the circumference, z the depth from the
/// camera in the half-plane through the axis and the point.
#[derive(Debug, Clone, Copy)]
pub struct Unrolled {
    /// The point of the axis nearest to the optical axis of the camera.
    origin_mm: Vector3<f64>,
    /// Unit vectors: from the axis to the camera, along the circumference, along the axis.
    axes: [Vector3<f64>; 3],
    /// Elevation of the camera above the plane of rotation.
    elevation: Vector2<f64>,
    /// Distance of the camera from `origin_mm`.
    distance_mm: f64,
    /// Radius at which y measures true lengths.
    radius_mm: f64,
}

impl FrameMotion {
    /// A frame of a part at rest.
    pub fn at_rest() -> Self {
        Self { motion: Motion::identity(), chart: Chart::Part, angle_rad: 0.0 }
    }

    /// The motion of the part at `position`; `None` if that is a position of another kind of stage.
    pub fn new(stage: &Stage, position: StagePosition, depth_range_mm: DepthRangeMm) -> Option<Self> {
        let chart = match stage {
            Stage::Linear(_) => Chart::Part,
            Stage::Rotary(axis) => Chart::Unrolled(Unrolled::new(axis, depth_range_mm)),
        };
        let angle_rad = position.deg().map_or(0.0, f64::to_radians);
        Some(Self { motion: stage.motion(position)?, chart, angle_rad })
    }

    /// Chart coordinates of a point in the camera frame.
    #[inline]
    pub fn chart_from_camera(&self, hit: &PointMm<CameraFrame>) -> Vector3<f64> {
        match &self.chart {
            Chart::Part => self.motion.part_from_camera(hit).xyz,
            Chart::Unrolled(unrolled) => unrolled.chart_from_camera_point(&hit.xyz, self.angle_rad),
        }
    }

    /// View coordinates of a chart point in this frame: across the view at `reference_depth_mm`, in the axes of the
    /// chart, and depth.
    #[inline]
    pub fn seen_from(&self, in_chart: &Vector3<f64>, reference_depth_mm: f64) -> Vector3<f64> {
        let at_reference = |seen: &Vector3<f64>| seen.xy() * (reference_depth_mm / seen.z);
        match &self.chart {
            Chart::Part => {
                let seen = in_chart + self.motion.shift_mm();
                let across = at_reference(&seen);
                Vector3::new(across.x, across.y, seen.z)
            }
            Chart::Unrolled(unrolled) => {
                let seen = unrolled.camera_from_chart_point(in_chart, self.angle_rad);
                let across = at_reference(&seen);
                let [along_turn, along_axis] =
                    [1, 2].map(|axis| unrolled.axes[axis].xy().dot(&across) / unrolled.axes[axis].xy().norm());
                Vector3::new(along_axis, along_turn, seen.z)
            }
        }
    }

    /// The chart.
    pub fn chart(&self) -> Chart {
        self.chart
    }

    /// Position of the frame along the travel, in the chart: the distance of its lines from those of another frame.
    pub fn travel_mm(&self) -> Vector3<f64> {
        match &self.chart {
            Chart::Part => *self.motion.shift_mm(),
            Chart::Unrolled(unrolled) => Vector3::new(0.0, unrolled.radius_mm * self.angle_rad, 0.0),
        }
    }
}

impl Chart {
    /// View coordinates of a chart point: across at `reference_depth_mm`, and depth. `middle_mm`: moves the part on a
    /// linear stage to the middle of the scan.
    #[inline]
    pub fn view_of(
        &self,
        in_chart: &Vector3<f64>,
        middle_mm: &Vector3<f64>,
        reference_depth_mm: f64,
    ) -> Vector3<f64> {
        match self {
            Self::Part => {
                let seen = in_chart + middle_mm;
                let across = seen.xy() * (reference_depth_mm / seen.z);
                Vector3::new(across.x, across.y, seen.z)
            }
            // Along the circumference every point is viewed head-on.
            Self::Unrolled(_) => {
                Vector3::new(in_chart.x * (reference_depth_mm / in_chart.z), in_chart.y, in_chart.z)
            }
        }
    }

    /// Length of a full turn along y; `None` for a linear stage.
    pub fn period_mm(&self) -> Option<f64> {
        match self {
            Self::Part => None,
            Self::Unrolled(unrolled) => Some(TAU * unrolled.radius_mm),
        }
    }
}

impl Unrolled {
    /// About `axis`, for a part in this depth range.
    fn new(axis: &RotaryAxis, depth_range_mm: DepthRangeMm) -> Self {
        // Nearest point of the optical axis to the rotation axis; for parallel axes, the foot of the perpendicular
        // from the camera.
        let (d, z) = (axis.direction, Vector3::z());
        let across = z - d * d.z;
        let nearest_mm = z * (across.dot(&axis.point_mm) / across.norm_squared().max(f64::MIN_POSITIVE));
        let origin_mm = axis.with_point_near(&nearest_mm).point_mm;
        let height_mm = -d.dot(&origin_mm);
        let to_camera = -origin_mm - d * height_mm;
        let towards = to_camera.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::z);
        let distance_mm = origin_mm.norm();
        // Half the distance between the axis and the nearest depth.
        let clearance_mm = origin_mm.z - depth_range_mm.near_mm;
        let depths_mm = depth_range_mm.far_mm - depth_range_mm.near_mm;
        let radius_mm = 0.5 * if clearance_mm > 0.0 { clearance_mm } else { depths_mm };
        Self {
            origin_mm,
            axes: [towards, d.cross(&towards), d],
            elevation: Vector2::new(to_camera.norm(), height_mm) / distance_mm,
            distance_mm,
            radius_mm,
        }
    }

    /// Chart coordinates of a camera-frame point while the table is at `angle_rad`.
    fn chart_from_camera_point(&self, in_camera: &Vector3<f64>, angle_rad: f64) -> Vector3<f64> {
        let from_origin = in_camera - self.origin_mm;
        let [towards, along, height] = self.axes.map(|axis| axis.dot(&from_origin));
        // The branch cut of atan2 lies behind the axis, where no light falls: positions are continuous over the
        // frames.
        let (radius, turn_rad) = (towards.hypot(along), along.atan2(towards));
        let (cos, sin) = (self.elevation.x, self.elevation.y);
        Vector3::new(
            height * cos - radius * sin,
            self.radius_mm * (turn_rad - angle_rad),
            self.distance_mm - radius * cos - height * sin,
        )
    }

    /// Camera-frame coordinates of a chart point while the table is at `angle_rad`.
    fn camera_from_chart_point(&self, in_chart: &Vector3<f64>, angle_rad: f64) -> Vector3<f64> {
        let (cos, sin) = (self.elevation.x, self.elevation.y);
        let nearness = self.distance_mm - in_chart.z;
        let (radius, height) = (nearness * cos - in_chart.x * sin, in_chart.x * cos + nearness * sin);
        let (along, towards) = (in_chart.y / self.radius_mm + angle_rad).sin_cos();
        let [e_towards, e_along, e_height] = self.axes;
        self.origin_mm + e_towards * (radius * towards) + e_along * (radius * along) + e_height * height
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding over lengths of 400 mm.
    const EXACT_MM: f64 = 1e-9;

    #[test]
    fn chart_positions_match_the_camera_and_turn_with_the_next_frame() {
        let axis = RotaryAxis::new(Vector3::new(3.0, -20.0, 410.0), Vector3::new(0.05, -0.96, 0.28));
        let unrolled = Unrolled::new(&axis, DepthRangeMm { near_mm: 350.0, far_mm: 450.0 });
        let seen = Vector3::new(12.0, -31.0, 388.0);
        let place = unrolled.chart_from_camera_point(&seen, 1.0);
        assert!((unrolled.camera_from_chart_point(&place, 1.0) - seen).norm() < EXACT_MM);
        let part = axis.part_from_camera(&PointMm::new(seen), 1.0);
        let later = axis.motion(1.3).camera_from_part(&part);
        assert!((unrolled.camera_from_chart_point(&place, 1.3) - later.xyz).norm() < EXACT_MM);
        assert!((unrolled.chart_from_camera_point(&later.xyz, 1.3) - place).norm() < EXACT_MM);
    }

    #[test]
    fn depth_decreases_towards_the_camera_and_repeats_after_a_turn() {
        let axis = RotaryAxis::new(Vector3::new(0.0, 0.0, 400.0), -Vector3::y());
        let unrolled = Unrolled::new(&axis, DepthRangeMm { near_mm: 350.0, far_mm: 450.0 });
        let depth = |z: f64| unrolled.chart_from_camera_point(&Vector3::new(0.0, 0.0, z), 0.0).z;
        assert!((depth(370.0) - 370.0).abs() < EXACT_MM && (depth(390.0) - 390.0).abs() < EXACT_MM);
        let chart = Chart::Unrolled(unrolled);
        let back = unrolled.chart_from_camera_point(&Vector3::new(0.0, 0.0, 370.0), TAU);
        assert!((back.y + chart.period_mm().unwrap()).abs() < EXACT_MM);
    }
}
