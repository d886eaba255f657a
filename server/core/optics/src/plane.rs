//! One plane per order, the paper's "traditional" model: n·X + d = 0, eq. (2).

use nalgebra::Vector3;

use crate::rotation::completing_frame;

/// Free parameters of a plane: two angles of its normal, its offset.
pub const PLANE_PARAMETERS: usize = 3;

/// A plane n·X + d = 0 in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// d; the plane is at distance |d| from the origin.
    pub offset_mm: f64,
}

impl Plane {
    /// The plane through `point` with unit `normal`.
    pub fn through(point: &Vector3<f64>, normal: Vector3<f64>) -> Self {
        Self { normal, offset_mm: -normal.dot(point) }
    }

    /// Signed distance of a point, mm.
    pub fn distance_mm(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) + self.offset_mm
    }

    /// z of the point of `ray` = (x_h, y_h, 1) in the plane; `None` if they are parallel or meet behind the camera.
    pub fn depth_along(&self, ray: &Vector3<f64>) -> Option<f64> {
        let depth = -self.offset_mm / self.normal.dot(ray);
        (depth.is_finite() && depth > 0.0).then_some(depth)
    }

    /// d(n·X + d) / d(two normal angles, offset) at a point.
    pub fn distance_by_parameters(&self, point: &Vector3<f64>) -> [f64; PLANE_PARAMETERS] {
        let (e1, e2) = completing_frame(&self.normal);
        [e1.dot(point), e2.dot(point), 1.0]
    }

    /// Moved by (normal towards e1, normal towards e2, offset), with the frame of [`completing_frame`].
    pub fn stepped(&self, step: &[f64]) -> Self {
        let (e1, e2) = completing_frame(&self.normal);
        Self {
            normal: (self.normal + e1 * step[0] + e2 * step[1]).normalize(),
            offset_mm: self.offset_mm + step[2],
        }
    }
}
