//! Planes related by the scalar grating equation, the paper's "proposed" model, eq. (5), (7)–(10): all planes share one
//! line, and plane m is at the angle θ_m = asin(m·λ/d_g) to plane 0.

use nalgebra::Vector3;

use crate::plane::Plane;
use crate::rotation::rotated;

/// Free parameters of a pencil: common line 4, angle of plane 0 about it, wavelength over period.
pub const PENCIL_PARAMETERS: usize = 6;

/// Names of the local parameters in the order of every step vector and covariance matrix.
pub const PENCIL_PARAMETER_NAMES: [&str; PENCIL_PARAMETERS] = [
    "line_along_normal_mm",
    "line_across_normal_mm",
    "line_tilt_to_normal_rad",
    "line_tilt_across_normal_rad",
    "base_angle_rad",
    "wavelength_over_period",
];

/// A pencil of planes through one line, in the camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pencil {
    /// A point of the common line.
    pub point_mm: Vector3<f64>,
    /// Direction of the common line; unit. Order m's normal is rotated about it by +asin(m·s).
    pub direction: Vector3<f64>,
    /// Normal of plane 0; unit, perpendicular to `direction`.
    pub base_normal: Vector3<f64>,
    /// s = λ/d_g.
    pub wavelength_over_period: f64,
}

impl Pencil {
    /// The plane of `order`; `None` if the order is evanescent.
    pub fn plane(&self, order: i8) -> Option<Plane> {
        let sine = f64::from(order) * self.wavelength_over_period;
        if sine.abs() >= 1.0 {
            return None;
        }
        let normal = rotated(&self.base_normal, &self.direction, sine.asin());
        Some(Plane::through(&self.point_mm, normal))
    }

    /// d(distance to plane m) / d(local parameters) at a point.
    pub fn distance_by_parameters(&self, order: i8, point: &Vector3<f64>) -> Option<[f64; PENCIL_PARAMETERS]> {
        let normal = self.plane(order)?.normal;
        let across = self.direction.cross(&self.base_normal);
        let lever = point - self.point_mm;
        let m = f64::from(order);
        let sine = m * self.wavelength_over_period;
        let angle = sine.asin();
        let tangent = self.direction.cross(&normal);
        // Tilting the line towards e tilts the plane's normal n towards −(n·e)·direction.
        let along = lever.dot(&self.direction);
        Some([
            -normal.dot(&self.base_normal),
            -normal.dot(&across),
            -angle.cos() * along,
            -angle.sin() * along,
            tangent.dot(&lever),
            tangent.dot(&lever) * m / (1.0 - sine * sine).sqrt(),
        ])
    }

    /// Moved by a local step, in the order of [`PENCIL_PARAMETER_NAMES`].
    pub fn stepped(&self, step: &[f64; PENCIL_PARAMETERS]) -> Self {
        let across = self.direction.cross(&self.base_normal);
        let direction = (self.direction + self.base_normal * step[2] + across * step[3]).normalize();
        let base = self.base_normal + across * step[4];
        Self {
            point_mm: self.point_mm + self.base_normal * step[0] + across * step[1],
            direction,
            base_normal: (base - direction * base.dot(&direction)).normalize(),
            wavelength_over_period: self.wavelength_over_period + step[5],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pencil() -> Pencil {
        let direction = Vector3::new(1.0, 0.01, 0.02).normalize();
        let normal = Vector3::new(0.0, -0.9, 0.4);
        let base_normal = (normal - direction * normal.dot(&direction)).normalize();
        let point_mm = Vector3::new(2.0, -170.0, 20.0);
        Pencil { point_mm, direction, base_normal, wavelength_over_period: 0.033 }
    }

    #[test]
    fn planes_are_at_the_angles_of_the_grating_equation() {
        let pencil = pencil();
        let (zero, two) = (pencil.plane(0).unwrap(), pencil.plane(2).unwrap());
        assert!((zero.normal.cross(&two.normal).norm() - 0.066).abs() < 1e-14);
        assert!(two.distance_mm(&(pencil.point_mm + pencil.direction * 50.0)).abs() < 1e-12);
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        const STEP: f64 = 1e-6;
        let (pencil, point) = (pencil(), Vector3::new(40.0, -30.0, 410.0));
        for order in [-3, 0, 2] {
            let exact = pencil.distance_by_parameters(order, &point).unwrap();
            for parameter in 0..PENCIL_PARAMETERS {
                let moved = |size: f64| {
                    let mut step = [0.0; PENCIL_PARAMETERS];
                    step[parameter] = size;
                    pencil.stepped(&step).plane(order).unwrap().distance_mm(&point)
                };
                let difference = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                assert!((difference - exact[parameter]).abs() < 1e-6, "{order} {parameter}");
            }
        }
    }
}
