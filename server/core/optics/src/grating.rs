//! The exact light surfaces behind a grating (`docs/maths/grating.md`): a diverging line diffracts into
//! curved sheets, and every order shares the same ten parameters.

use nalgebra::Vector3;

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

/// Squared sine of the angle between projector and camera axes below which they are treated as parallel, without a
/// nearest point.
const PARALLEL_AXES: f64 = 1e-6;

/// A laser line source behind a plane transmission grating, in the camera frame.
///
/// Light passes from `source_mm` along k(φ) = cosφ·axis + sinφ·fan, meets the grating at distance `gap_mm`
/// along `normal`, and leaves it with `order` grating momenta added along the period direction normal × groove.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grating {
    /// S, the origin of the fan's rays.
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
        self.diffracted(&self.fan_ray(phi_rad), order)
    }

    /// The diffracted ray for the fan's ray `k`: see [`Grating::ray`].
    pub(crate) fn diffracted(&self, k: &Vector3<f64>, order: i8) -> Option<LightRay> {
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

    /// Displacement of the sheet of `order` along its unit `normal`, at `path_length_mm` from the grating along the ray
    /// of φ, per local parameter (mm per unit): normal · (dQ + path length · dk'), by `docs/maths/grating.md`, eq. 6–8.
    /// Differentiated in reverse mode, so that the ten parameters share nearly all of the work.
    ///
    /// `None` where there is no such ray.
    pub fn normal_motion(
        &self,
        phi_rad: f64,
        order: i8,
        path_length_mm: f64,
        normal: &Vector3<f64>,
    ) -> Option<[f64; GRATING_PARAMETERS]> {
        let (sin, cos) = phi_rad.sin_cos();
        let (a, f, n, g) = (self.axis, self.fan, self.normal, self.groove);
        let (p, across) = (self.period_direction(), a.cross(&f));
        let k = a * cos + f * sin;
        let direction = self.diffracted(&k, order)?.direction;
        let (incidence, forward) = (k.dot(&n), direction.dot(&n));
        let tangential = direction - n * forward;
        // Derivative of the distance with respect to each moving quantity, for fixed earlier ones.
        let by_tangential = (normal - tangential * (normal.dot(&n) / forward)) * path_length_mm;
        let by_incidence =
            -normal.dot(&k) * self.gap_mm / (incidence * incidence) - path_length_mm * normal.dot(&n);
        let by_ray = normal * (self.gap_mm / incidence) + by_tangential + n * by_incidence;
        let by_normal = normal * (path_length_mm * forward) - by_tangential * incidence + k * by_incidence;
        let by_gap = normal.dot(&k) / incidence;
        let by_momentum = by_tangential * f64::from(order);
        let by_period = by_momentum * self.wavelength_over_period;
        Some([
            normal.x,
            normal.y,
            normal.z,
            by_ray.dot(&across) * sin,
            normal.dot(&across) * self.pivot_distance_mm() - by_ray.dot(&across) * cos,
            by_normal.dot(&g),
            by_normal.dot(&p) - by_period.dot(&n),
            -by_period.dot(&g),
            by_gap - normal.dot(&a) / a.dot(&n),
            by_momentum.dot(&p),
        ])
    }

    /// Distance from the source along the axis to the point nearest to the camera's optical axis: the middle of the
    /// common volume. The fan pitches about this point, which decorrelates its position there from its angle.
    fn pivot_distance_mm(&self) -> f64 {
        let across_z = 1.0 - self.axis.z * self.axis.z;
        if across_z < PARALLEL_AXES {
            return 0.0;
        }
        -(self.source_mm.x * self.axis.x + self.source_mm.y * self.axis.y) / across_z
    }

    /// Moved by a local step, in the order of [`GRATING_PARAMETER_NAMES`]; directions stay unit and perpendicular.
    ///
    /// The fan pitches about the point of its axis nearest to the camera's optical axis, and an increase of the gap
    /// moves the source back from the grating. Neither shifts the sheets in the scene; only the source's own
    /// coordinates do.
    pub fn stepped(&self, step: &[f64; GRATING_PARAMETERS]) -> Self {
        let across = self.axis.cross(&self.fan);
        let fan = (self.fan + across * step[3]).normalize();
        let axis = self.axis - across * step[4];
        let axis = (axis - fan * axis.dot(&fan)).normalize();
        let period = self.period_direction();
        let normal = (self.normal + self.groove * step[5] + period * step[6]).normalize();
        // The grating momentum s·p moves linearly within the grating's plane.
        let momentum = period * (self.wavelength_over_period + step[9])
            - self.groove * (self.wavelength_over_period * step[7]);
        let momentum_size = momentum.norm();
        let groove = momentum.cross(&self.normal) / momentum_size;
        let groove = (groove - normal * groove.dot(&normal)).normalize();
        let pitch = (self.axis - axis) * self.pivot_distance_mm();
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
    fn order_zero_is_not_deflected() {
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
        // Second-order truncation of a step of 1e-5 stays below 1e-7 at these lengths (≤ 20 mm) and directions …
        const STEP: f64 = 1e-5;
        const TOLERANCE: f64 = 1e-7;
        // … at these distances behind the grating.
        const PATH_LENGTHS_MM: [f64; 2] = [0.0, 400.0];
        let grating = grating();
        for (phi, order) in [(0.25, -2), (-0.1, 1), (0.3, 4)] {
            for path_length_mm in PATH_LENGTHS_MM {
                let point = |step: &[f64; GRATING_PARAMETERS]| {
                    let ray = grating.stepped(step).ray(phi, order).unwrap();
                    ray.origin_mm + ray.direction * path_length_mm
                };
                for axis in 0..3 {
                    let normal = Vector3::ith(axis, 1.0);
                    let exact = grating.normal_motion(phi, order, path_length_mm, &normal).unwrap();
                    for parameter in 0..GRATING_PARAMETERS {
                        let mut step = [0.0; GRATING_PARAMETERS];
                        step[parameter] = STEP;
                        let moved = point(&step) - point(&step.map(|size| -size));
                        let difference = moved[axis] / (2.0 * STEP);
                        assert!(
                            (difference - exact[parameter]).abs() < TOLERANCE * (1.0 + path_length_mm),
                            "{parameter}: {difference} {}",
                            exact[parameter]
                        );
                    }
                }
            }
        }
    }
}
