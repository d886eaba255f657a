//! Planes, spheres, cylinders: signed distance, its derivatives, small steps.

use nalgebra::Vector3;
use optics::Rigid;

use crate::params::MIN_COSINE;

/// Parameters of the largest shape.
pub(crate) const MAX_PARAMETERS: usize = 5;

/// A geometric feature in the part frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// n·(X − point) = 0.
    Plane {
        /// A point on it; after a fit the centroid of the points.
        point_mm: Vector3<f64>,
        /// Unit normal.
        normal: Vector3<f64>,
    },
    /// |X − centre| = radius.
    Sphere {
        /// Centre.
        centre_mm: Vector3<f64>,
        /// Radius.
        radius_mm: f64,
    },
    /// Distance from the axis = radius.
    Cylinder {
        /// A point on the axis; after a fit the projection of the points' centroid.
        point_mm: Vector3<f64>,
        /// Unit vector along the axis.
        axis: Vector3<f64>,
        /// Radius.
        radius_mm: f64,
    },
}

/// Two unit vectors perpendicular to a unit vector and to each other.
pub(crate) fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let helper = if direction.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = direction.cross(&helper).normalize();
    [first, direction.cross(&first)]
}

impl Shape {
    /// The same shape in another frame; `pose` maps from its frame to that one.
    pub fn moved<To, From>(&self, pose: &Rigid<To, From>) -> Self {
        let at = |place: &Vector3<f64>| pose.rotation * place + pose.translation_mm;
        let to = |direction: &Vector3<f64>| pose.rotation * direction;
        match self {
            Self::Plane { point_mm, normal } => Self::Plane { point_mm: at(point_mm), normal: to(normal) },
            Self::Sphere { centre_mm, radius_mm } => {
                Self::Sphere { centre_mm: at(centre_mm), radius_mm: *radius_mm }
            }
            Self::Cylinder { point_mm, axis, radius_mm } => {
                Self::Cylinder { point_mm: at(point_mm), axis: to(axis), radius_mm: *radius_mm }
            }
        }
    }

    /// Number of free parameters.
    pub(crate) fn parameters(&self) -> usize {
        match self {
            Self::Plane { .. } => 3,
            Self::Sphere { .. } => 4,
            Self::Cylinder { .. } => 5,
        }
    }

    /// Signed distance of a point, mm: positive on the normal's side, or outside.
    pub fn distance_mm(&self, position: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane { point_mm, normal } => normal.dot(&(position - point_mm)),
            Self::Sphere { centre_mm, radius_mm } => (position - centre_mm).norm() - radius_mm,
            Self::Cylinder { point_mm, axis, radius_mm } => {
                perpendicular(position, point_mm, axis).norm() - radius_mm
            }
        }
    }

    /// Unit normal of the surface nearest to a point, towards positive distance.
    pub fn normal_at(&self, position: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Plane { normal, .. } => *normal,
            Self::Sphere { centre_mm, .. } => (position - centre_mm).normalize(),
            Self::Cylinder { point_mm, axis, .. } => perpendicular(position, point_mm, axis).normalize(),
        }
    }

    /// Largest curvature of the surface, 1/mm.
    pub(crate) fn largest_curvature(&self) -> f64 {
        match self {
            Self::Plane { .. } => 0.0,
            Self::Sphere { radius_mm, .. } | Self::Cylinder { radius_mm, .. } => 1.0 / radius_mm,
        }
    }

    /// Curvature of the surface along a unit tangent, 1/mm.
    pub(crate) fn curvature_along(&self, tangent: &Vector3<f64>) -> f64 {
        match self {
            Self::Plane { .. } | Self::Sphere { .. } => self.largest_curvature(),
            Self::Cylinder { axis, .. } => self.largest_curvature() * (1.0 - axis.dot(tangent).powi(2)),
        }
    }

    /// The intersection of the ray through a point with the surface, to first order; near the limb, where the ray may
    /// miss, with the cosine limited to [`MIN_COSINE`].
    pub(crate) fn foot_on_ray(&self, position: &Vector3<f64>, ray: &Vector3<f64>) -> Vector3<f64> {
        let steepness = ray.dot(&self.normal_at(position));
        let bounded = steepness.abs().max(MIN_COSINE) * steepness.signum();
        position - ray * (self.distance_mm(position) / bounded)
    }

    /// Precomputes the terms common to all points.
    pub(crate) fn linearised(&self) -> Linearised {
        let axes = match self {
            Self::Plane { normal: direction, .. } | Self::Cylinder { axis: direction, .. } => across(direction),
            Self::Sphere { .. } => [Vector3::zeros(); 2],
        };
        Linearised { shape: *self, axes }
    }

    /// Moved by a small step of the local parameters:
    /// plane: two tilts about its point (rad), shift along the normal (mm);
    /// sphere: centre (mm), radius (mm);
    /// cylinder: two tilts of the axis about its point (rad), two shifts of the point (mm), radius (mm).
    pub(crate) fn stepped(&self, step: &[f64; MAX_PARAMETERS]) -> Self {
        match *self {
            Self::Plane { point_mm, normal } => {
                let [first, second] = across(&normal);
                Self::Plane {
                    point_mm: point_mm + normal * step[2],
                    normal: (normal + first * step[0] + second * step[1]).normalize(),
                }
            }
            Self::Sphere { centre_mm, radius_mm } => Self::Sphere {
                centre_mm: centre_mm + Vector3::new(step[0], step[1], step[2]),
                radius_mm: radius_mm + step[3],
            },
            Self::Cylinder { point_mm, axis, radius_mm } => {
                let [first, second] = across(&axis);
                Self::Cylinder {
                    point_mm: point_mm + first * step[2] + second * step[3],
                    axis: (axis + first * step[0] + second * step[1]).normalize(),
                    radius_mm: radius_mm + step[4],
                }
            }
        }
    }

    /// The same surface with its point (if it is arbitrary) moved next to `centroid`.
    pub(crate) fn anchored(&self, centroid: &Vector3<f64>) -> Self {
        match *self {
            Self::Plane { normal, .. } => {
                Self::Plane { point_mm: centroid - normal * self.distance_mm(centroid), normal }
            }
            Self::Sphere { .. } => *self,
            Self::Cylinder { point_mm, axis, radius_mm } => {
                Self::Cylinder { point_mm: point_mm + axis * axis.dot(&(centroid - point_mm)), axis, radius_mm }
            }
        }
    }

    /// A plane with its normal opposite to `ray`, i.e. towards the camera; other shapes unchanged.
    pub(crate) fn facing(&self, ray: &Vector3<f64>) -> Self {
        match *self {
            Self::Plane { point_mm, normal } if normal.dot(ray) > 0.0 => Self::Plane { point_mm, normal: -normal },
            other => other,
        }
    }
}

fn perpendicular(position: &Vector3<f64>, point: &Vector3<f64>, axis: &Vector3<f64>) -> Vector3<f64> {
    let from_point = position - point;
    from_point - axis * axis.dot(&from_point)
}

/// A shape with its tangent axes precomputed.
pub(crate) struct Linearised {
    shape: Shape,
    axes: [Vector3<f64>; 2],
}

impl Linearised {
    /// Residual of a point with an error along `ray`, and its derivatives with respect to the local parameters.
    ///
    /// Both are taken at the foot of the point on the surface along its ray: derivatives at the noisy point itself
    /// correlate with the noise and bias a radius by about −σ²/R times a factor that grows as the cap gets smaller.
    pub(crate) fn residual_and_gradient(
        &self,
        position: &Vector3<f64>,
        ray: &Vector3<f64>,
    ) -> (f64, [f64; MAX_PARAMETERS]) {
        let foot = match self.shape {
            Shape::Plane { .. } => return self.distance_and_gradient(position),
            _ => self.shape.foot_on_ray(position, ray),
        };
        let (short, gradient) = self.distance_and_gradient(&foot);
        (short + self.shape.normal_at(&foot).dot(&(position - foot)), gradient)
    }

    /// Signed distance and its derivatives with respect to the local parameters (unused ones are zero).
    fn distance_and_gradient(&self, position: &Vector3<f64>) -> (f64, [f64; MAX_PARAMETERS]) {
        let [first, second] = &self.axes;
        match &self.shape {
            Shape::Plane { point_mm, normal } => {
                let offset = position - point_mm;
                (normal.dot(&offset), [first.dot(&offset), second.dot(&offset), -1.0, 0.0, 0.0])
            }
            Shape::Sphere { centre_mm, radius_mm } => {
                let offset = position - centre_mm;
                let reach = offset.norm();
                let outward = offset / reach;
                (reach - radius_mm, [-outward.x, -outward.y, -outward.z, -1.0, 0.0])
            }
            Shape::Cylinder { point_mm, axis, radius_mm } => {
                let along = axis.dot(&(position - point_mm));
                let offset = perpendicular(position, point_mm, axis);
                let reach = offset.norm();
                let outward = offset / reach;
                let (one, two) = (first.dot(&outward), second.dot(&outward));
                (reach - radius_mm, [-along * one, -along * two, -one, -two, -1.0])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_agree_with_central_differences() {
        let direction = Vector3::new(0.2, -0.5, 0.8).normalize();
        let point_mm = Vector3::new(3.0, -2.0, 401.0);
        let shapes = [
            Shape::Plane { point_mm, normal: direction },
            Shape::Sphere { centre_mm: point_mm, radius_mm: 18.9 },
            Shape::Cylinder { point_mm, axis: direction, radius_mm: 7.0 },
        ];
        let position = Vector3::new(11.0, 4.0, 390.0);
        for shape in shapes {
            let (distance, gradient) = shape.linearised().distance_and_gradient(&position);
            assert!((distance - shape.distance_mm(&position)).abs() < 1e-12);
            for (parameter, slope) in gradient.iter().enumerate().take(shape.parameters()) {
                let moved = |size: f64| {
                    let mut step = [0.0; MAX_PARAMETERS];
                    step[parameter] = size;
                    shape.stepped(&step).distance_mm(&position)
                };
                let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((difference - slope).abs() < 1e-8, "{shape:?} {parameter}: {difference} {slope}");
            }
        }
    }
}
