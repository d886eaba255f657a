//! The exact light surfaces behind a grating (`docs/maths/grating.md`): a diverging line diffracts into
//! curved sheets, and every order shares the same ten parameters.

use nalgebra::{SMatrix, Vector3};

use crate::rotation::turned;

/// Free parameters of a grating: source 3, fan plane 2 angles, grating normal 2 angles, groove angle,
/// gap, wavelength over period.
pub const GRATING_PARAMETERS: usize = 10;

/// Names of the local parameters in the order of every step vector and covariance matrix.
pub const GRATING_PARAMETER_NAMES: [&str; GRATING_PARAMETERS] = [
    "source_x_mm",
    "source_y_mm",
    "source_z_mm",
    "fan_roll_rad",
    "fan_pitch_rad",
    "normal_along_groove_rad",
    "normal_along_period_rad",
    "groove_angle_rad",
    "gap_mm",
    "wavelength_over_period",
];

/// Squared sine of the angle between projector and camera axes below which they have no nearest point to speak of.
const PARALLEL_AXES: f64 = 1e-6;

/// A laser line source behind a plane transmission grating, in the camera frame.
///
/// Light passes from `source_mm` along k(φ) = cosφ·axis + sinφ·fan, meets the grating at distance `gap_mm`
/// along `normal`, and leaves it with `order` grating momenta added along the period direction normal × groove.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grating {
    /// S, where the fan's rays come from.
    pub source_mm: Vector3<f64>,
    /// a, the fan's optical axis; unit, perpendicular to `fan`.
    pub axis: Vector3<f64>,
    /// f, the direction in which the line spreads; unit.
    pub fan: Vector3<f64>,
    /// n, the grating's normal, pointing away from the source; unit.
    pub normal: Vector3<f64>,
    /// g, the direction of the grooves; unit, perpendicular to `normal`.
    pub groove: Vector3<f64>,
    /// h, distance from the source to the grating along the normal.
    pub gap_mm: f64,
    /// s = λ/d_g.
    pub wavelength_over_period: f64,
}

/// One ray of one order: a point on the grating and the unit direction of flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightRay {
    /// Q(φ).
    pub origin_mm: Vector3<f64>,
    /// k'_m(φ).
    pub direction: Vector3<f64>,
}

/// Derivatives of a [`LightRay`].
#[derive(Debug, Clone, Copy)]
pub struct LightRayJacobian {
    /// The ray itself.
    pub ray: LightRay,
    /// dQ/dφ.
    pub origin_by_phi: Vector3<f64>,
    /// dk'/dφ.
    pub direction_by_phi: Vector3<f64>,
    /// dQ / d(local parameters).
    pub origin_by_grating: SMatrix<f64, 3, GRATING_PARAMETERS>,
    /// dk' / d(local parameters).
    pub direction_by_grating: SMatrix<f64, 3, GRATING_PARAMETERS>,
}

/// What moves while a derivative is taken: the fan ray, the grating's vectors and scalars.
struct Motion {
    source: Vector3<f64>,
    ray: Vector3<f64>,
    normal: Vector3<f64>,
    period: Vector3<f64>,
    gap: f64,
    s: f64,
}

impl Motion {
    fn none() -> Self {
        let zero = Vector3::zeros();
        Self { source: zero, ray: zero, normal: zero, period: zero, gap: 0.0, s: 0.0 }
    }
}

impl Grating {
    /// p = n × g, the direction across the grooves.
    pub fn period_direction(&self) -> Vector3<f64> {
        self.normal.cross(&self.groove)
    }

    /// The fan ray k(φ) before the grating.
    pub fn fan_ray(&self, phi_rad: f64) -> Vector3<f64> {
        self.axis * phi_rad.cos() + self.fan * phi_rad.sin()
    }

    /// The diffracted ray of `order` at fan angle φ; `None` where the ray misses the grating or is evanescent.
    pub fn ray(&self, phi_rad: f64, order: i8) -> Option<LightRay> {
        let k = self.fan_ray(phi_rad);
        let incidence = k.dot(&self.normal);
        if incidence <= 0.0 {
            return None;
        }
        let momentum = f64::from(order) * self.wavelength_over_period;
        let tangential = k - self.normal * incidence + self.period_direction() * momentum;
        let forward_squared = 1.0 - tangential.norm_squared();
        if forward_squared <= 0.0 {
            return None;
        }
        Some(LightRay {
            origin_mm: self.source_mm + k * (self.gap_mm / incidence),
            direction: tangential + self.normal * forward_squared.sqrt(),
        })
    }

    /// [`Grating::ray`] with its derivatives by φ and the ten local parameters.
    pub fn ray_with_jacobian(&self, phi_rad: f64, order: i8) -> Option<LightRayJacobian> {
        let ray = self.ray(phi_rad, order)?;
        let (sin, cos) = phi_rad.sin_cos();
        let (a, f, n, g) = (self.axis, self.fan, self.normal, self.groove);
        let (p, across) = (self.period_direction(), a.cross(&f));
        let by_phi = Motion { ray: f * cos - a * sin, ..Motion::none() };
        let motions = [
            Motion { source: Vector3::x(), ..Motion::none() },
            Motion { source: Vector3::y(), ..Motion::none() },
            Motion { source: Vector3::z(), ..Motion::none() },
            Motion { ray: across * sin, ..Motion::none() },
            Motion { ray: -across * cos, source: across * self.pivot_reach_mm(), ..Motion::none() },
            Motion { normal: g, ..Motion::none() },
            Motion { normal: p, period: -n, ..Motion::none() },
            Motion { period: -g, ..Motion::none() },
            Motion { gap: 1.0, source: -a / a.dot(&n), ..Motion::none() },
            Motion { s: 1.0, ..Motion::none() },
        ];
        let k = self.fan_ray(phi_rad);
        let (origin_by_phi, direction_by_phi) = self.moved_ray(&k, &ray, order, &by_phi);
        let mut origin_by_grating = SMatrix::<f64, 3, GRATING_PARAMETERS>::zeros();
        let mut direction_by_grating = SMatrix::<f64, 3, GRATING_PARAMETERS>::zeros();
        for (column, motion) in motions.iter().enumerate() {
            let (origin, direction) = self.moved_ray(&k, &ray, order, motion);
            origin_by_grating.set_column(column, &origin);
            direction_by_grating.set_column(column, &direction);
        }
        Some(LightRayJacobian { ray, origin_by_phi, direction_by_phi, origin_by_grating, direction_by_grating })
    }

    /// Directional derivative of (Q, k') along `motion` (`docs/maths/grating.md`, eq. 6–8).
    fn moved_ray(
        &self,
        k: &Vector3<f64>,
        ray: &LightRay,
        order: i8,
        motion: &Motion,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let n = self.normal;
        let m = f64::from(order);
        let incidence = k.dot(&n);
        let incidence_step = motion.ray.dot(&n) + k.dot(&motion.normal);
        let reach = self.gap_mm / incidence;
        let origin = motion.source + k * (motion.gap / incidence) + motion.ray * reach
            - k * (reach * incidence_step / incidence);
        let forward = ray.direction.dot(&n);
        let tangential = ray.direction - n * forward;
        let tangential_step = motion.ray - n * incidence_step - motion.normal * incidence
            + self.period_direction() * (m * motion.s)
            + motion.period * (m * self.wavelength_over_period);
        let forward_step = -tangential.dot(&tangential_step) / forward;
        (origin, tangential_step + n * forward_step + motion.normal * forward)
    }

    /// Distance from the source along the axis to where it comes nearest to the camera's optical axis: the middle of
    /// what both see. The fan pitches about this point, so that its position there and its angle are estimated apart.
    fn pivot_reach_mm(&self) -> f64 {
        let across_z = 1.0 - self.axis.z * self.axis.z;
        if across_z < PARALLEL_AXES {
            return 0.0;
        }
        -(self.source_mm.x * self.axis.x + self.source_mm.y * self.axis.y) / across_z
    }

    /// Moved by a local step, in the order of [`GRATING_PARAMETER_NAMES`]; directions stay unit and perpendicular.
    ///
    /// The fan pitches about the point of its axis nearest to the camera's optical axis, and the gap grows by moving
    /// the source away from the lit line: both leave the sheets' place in the scene to the source's own coordinates.
    pub fn stepped(&self, step: &[f64; GRATING_PARAMETERS]) -> Self {
        let across = self.axis.cross(&self.fan);
        let fan = (self.fan + across * step[3]).normalize();
        let axis = self.axis - across * step[4];
        let axis = (axis - fan * axis.dot(&fan)).normalize();
        let period = self.period_direction();
        let normal = (self.normal + self.groove * step[5] + period * step[6]).normalize();
        // The grating momentum s·p moves in a straight line within the grating's plane.
        let momentum = period * (self.wavelength_over_period + step[9])
            - self.groove * (self.wavelength_over_period * step[7]);
        let momentum_size = momentum.norm();
        let groove = momentum.cross(&self.normal) / momentum_size;
        let groove = (groove - normal * groove.dot(&normal)).normalize();
        let pitch = (self.axis - axis) * self.pivot_reach_mm();
        let retreat = self.axis * (step[8] / self.axis.dot(&self.normal));
        Self {
            source_mm: self.source_mm + Vector3::new(step[0], step[1], step[2]) + pitch - retreat,
            axis,
            fan,
            normal,
            groove,
            gap_mm: self.gap_mm + step[8],
            wavelength_over_period: momentum_size,
        }
    }

    /// The same surfaces with the fan's axis turned by `angle_rad` within the fan plane: only φ is renamed.
    pub fn with_axis_turned(&self, angle_rad: f64) -> Self {
        let across = self.axis.cross(&self.fan);
        Self { axis: turned(&self.axis, &across, angle_rad), fan: turned(&self.fan, &across, angle_rad), ..*self }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn grating() -> Grating {
        let normal = Vector3::new(-0.013, 0.387, 0.922).normalize();
        let axis = Vector3::new(-0.001, 0.409, 0.913).normalize();
        let fan = Vector3::new(1.0, 0.0034, 0.0);
        let fan = (fan - axis * fan.dot(&axis)).normalize();
        let groove = Vector3::new(1.0, 0.0087, 0.0105);
        let groove = (groove - normal * groove.dot(&normal)).normalize();
        let source_mm = Vector3::new(1.0, -174.0, 11.0);
        Grating { source_mm, axis, fan, normal, groove, gap_mm: 18.5, wavelength_over_period: 0.033 }
    }

    #[test]
    fn order_zero_goes_straight_on() {
        let grating = grating();
        let ray = grating.ray(0.2, 0).unwrap();
        assert!((ray.direction - grating.fan_ray(0.2)).norm() < 1e-14);
    }

    #[test]
    fn a_ray_in_normal_incidence_obeys_the_scalar_grating_equation() {
        // Eq. (5): sinθ = m·s when the ray meets the grating head on.
        let tilted = grating();
        let grating = Grating { axis: tilted.normal, fan: tilted.groove, ..tilted };
        let ray = grating.ray(0.0, 2).unwrap();
        assert!((ray.direction.cross(&grating.normal).norm() - 0.066).abs() < 1e-14);
    }

    #[test]
    fn an_evanescent_order_has_no_ray() {
        let fine = Grating { wavelength_over_period: 0.6, ..grating() };
        assert_eq!(fine.ray(0.0, 2), None);
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        // Second-order truncation of a step of 1e-5 stays below 1e-7 at these lengths (≤ 20 mm).
        const STEP: f64 = 1e-5;
        const TOLERANCE: f64 = 1e-7;
        let grating = grating();
        for (phi, order) in [(0.25, -2), (-0.1, 1), (0.3, 4)] {
            let exact = grating.ray_with_jacobian(phi, order).unwrap();
            for parameter in 0..GRATING_PARAMETERS {
                let moved = |size: f64| {
                    let mut step = [0.0; GRATING_PARAMETERS];
                    step[parameter] = size;
                    grating.stepped(&step).ray(phi, order).unwrap()
                };
                let (ahead, behind) = (moved(STEP), moved(-STEP));
                let origin = (ahead.origin_mm - behind.origin_mm) / (2.0 * STEP);
                let direction = (ahead.direction - behind.direction) / (2.0 * STEP);
                assert!((origin - exact.origin_by_grating.column(parameter)).norm() < TOLERANCE, "{parameter}");
                assert!(
                    (direction - exact.direction_by_grating.column(parameter)).norm() < TOLERANCE,
                    "{parameter}"
                );
            }
            let (ahead, behind) =
                (grating.ray(phi + STEP, order).unwrap(), grating.ray(phi - STEP, order).unwrap());
            let direction = (ahead.direction - behind.direction) / (2.0 * STEP);
            assert!((direction - exact.direction_by_phi).norm() < TOLERANCE);
        }
    }
}
