//! Exact rotations of vectors.

use nalgebra::{Rotation3, Unit, Vector3};

/// `vector` rotated about the unit vector `axis` by `angle_rad`.
pub(crate) fn rotated(vector: &Vector3<f64>, axis: &Vector3<f64>, angle_rad: f64) -> Vector3<f64> {
    Rotation3::from_axis_angle(&Unit::new_unchecked(*axis), angle_rad) * vector
}

/// Two unit vectors that complete the unit vector `normal` to a right-handed frame (e1, e2, normal).
pub fn completing_frame(normal: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if normal.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    let e1 = (helper - normal * normal.dot(&helper)).normalize();
    (e1, normal.cross(&e1))
}
