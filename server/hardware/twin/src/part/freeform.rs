//! A smooth part: Gaussian hills and hollows on a plate.

use nalgebra::Vector3;
use rand::Rng;
use rand_pcg::Pcg64;

use crate::params::PART_REFLECTANCE;
use crate::part::scene::{Plate, SceneHit};

/// Number of hills.
const HILLS: usize = 6;

/// Steps of the ray march towards the surface; four suffice unless the ray grazes a hill.
const MARCH_MAX_STEPS: usize = 200;

/// A hill is cut off beyond this exponent: exp(−34) of its height, 1e-14 mm, remains.
const FOOT_EXPONENT: f64 = 34.0;

/// Newton steps from a guess; from a neighbouring pixel's tangent plane two suffice.
const NEAR_MAX_STEPS: usize = 4;

/// Distance from the surface at which the march ends, mm.
const MARCH_TOLERANCE_MM: f64 = 1e-10;

/// A Gaussian hill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hill {
    /// Position along the plate's first two axes.
    pub at_mm: [f64; 2],
    /// Standard deviation of its profile.
    pub sigma_mm: f64,
    /// Height; negative for a hollow.
    pub height_mm: f64,
}

/// Gaussian hills on a plate: height(x, y) = Σ hᵢ exp(−|(x, y) − atᵢ|² / 2σᵢ²).
#[derive(Debug, Clone, PartialEq)]
pub struct Freeform {
    /// The plate below the hills.
    pub plate: Plate,
    /// The hills.
    pub hills: Vec<Hill>,
    /// Upper bound of the height.
    pub(crate) ceiling_mm: f64,
    /// Upper bound of the curvature, 1/mm.
    pub(crate) curvature: f64,
}

impl Freeform {
    /// Hills over the inner half of a field, up to a tenth of its half-width high.
    pub(crate) fn seeded(plate: Plate, field_half_width_mm: f64, rng: &mut Pcg64) -> Self {
        let size = field_half_width_mm;
        let hills = (0..HILLS)
            .map(|_| Hill {
                at_mm: [size * (rng.random::<f64>() - 0.5), size * 0.6 * (rng.random::<f64>() - 0.5)],
                sigma_mm: size * (0.1 + 0.12 * rng.random::<f64>()),
                height_mm: size * (0.1 * rng.random::<f64>() - 0.03),
            })
            .collect();
        Self::new(plate, hills)
    }

    /// A part with these hills.
    pub fn new(plate: Plate, hills: Vec<Hill>) -> Self {
        let ceiling_mm = hills.iter().map(|hill| hill.height_mm.max(0.0)).sum::<f64>() + MARCH_TOLERANCE_MM;
        // A Gaussian has its greatest curvature, h/σ², at its top.
        let curvature = hills.iter().map(|hill| hill.height_mm.abs() / (hill.sigma_mm * hill.sigma_mm)).sum();
        Self { plate, hills, ceiling_mm, curvature }
    }

    /// Height above the plate and its derivatives along the plate's first two axes.
    pub fn height_mm(&self, x_mm: f64, y_mm: f64) -> (f64, f64, f64) {
        self.hills.iter().fold((0.0, 0.0, 0.0), |(h, hx, hy), hill| {
            let (dx, dy) = (x_mm - hill.at_mm[0], y_mm - hill.at_mm[1]);
            let curvature = 1.0 / (hill.sigma_mm * hill.sigma_mm);
            let exponent = (dx * dx + dy * dy) * curvature / 2.0;
            if exponent > FOOT_EXPONENT {
                return (h, hx, hy);
            }
            let part = hill.height_mm * (-exponent).exp();
            (h + part, hx - part * dx * curvature, hy - part * dy * curvature)
        })
    }

    /// Intersection of a ray from above with the part, by Newton steps from the guess `ray_length`; `None` if they do
    /// not converge or the curvature bound does not prove that it is the first intersection.
    pub(crate) fn hit_from(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        mut ray_length: f64,
    ) -> Option<SceneHit> {
        let from = self.plate.local(&(origin - self.plate.point_mm));
        let dir = self.plate.local(direction);
        for _ in 0..NEAR_MAX_STEPS {
            let at = from + dir * ray_length;
            let (height, slope_x, slope_y) = self.height_mm(at.x, at.y);
            let above = at.z - height;
            let closing = slope_x * dir.x + slope_y * dir.y - dir.z;
            if above.abs() < MARCH_TOLERANCE_MM {
                let normal = self.plate.axes * Vector3::new(-slope_x, -slope_y, 1.0).normalize();
                let first = ray_length > 0.0 && self.is_proven_free(&dir, at.z, closing, ray_length);
                return first.then_some(SceneHit { ray_length, normal, reflectance: PART_REFLECTANCE });
            }
            ray_length += above / closing;
        }
        None
    }

    /// Whether light from `from` is proven to reach `to`, a point of the surface with this normal. `false` is
    /// inconclusive.
    pub(crate) fn is_proven_lit(&self, from: &Vector3<f64>, to: &Vector3<f64>, normal: &Vector3<f64>) -> bool {
        let dir = self.plate.local(&(to - from));
        let normal = self.plate.local(normal);
        let at_mm = self.plate.local(&(to - self.plate.point_mm)).z;
        self.is_proven_free(&dir, at_mm, -normal.dot(&dir) / normal.z, 1.0)
    }

    /// Whether a ray was proven free over its last `ray_length`, where `closing` is its rate of approach to the surface
    /// at the hit, `at_mm` above the plate: backwards by s, it was above the surface by at least closing·s − C·s²/2.
    fn is_proven_free(&self, dir: &Vector3<f64>, at_mm: f64, closing: f64, ray_length: f64) -> bool {
        if dir.z >= 0.0 || closing <= 0.0 {
            return false;
        }
        let below_ceiling = ((self.ceiling_mm - at_mm) / -dir.z).min(ray_length);
        self.curvature * dir.xy().norm_squared() * below_ceiling < 2.0 * closing
    }

    /// Intersection of a ray from above with the part: with the curvature bounded by C, the height a above the surface
    /// cannot fall faster than a − ct − Ct²/2, whose root is a step that never overshoots and converges as fast as
    /// Newton's.
    pub(crate) fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<SceneHit> {
        let from = self.plate.local(&(origin - self.plate.point_mm));
        let dir = self.plate.local(direction);
        if dir.z >= 0.0 {
            return None;
        }
        let bend = 2.0 * self.curvature * dir.xy().norm_squared();
        let mut ray_length = ((self.ceiling_mm - from.z) / dir.z).max(0.0);
        for _ in 0..MARCH_MAX_STEPS {
            let at = from + dir * ray_length;
            let (height, slope_x, slope_y) = self.height_mm(at.x, at.y);
            let above = at.z - height;
            if above.abs() < MARCH_TOLERANCE_MM {
                let normal = self.plate.axes * Vector3::new(-slope_x, -slope_y, 1.0).normalize();
                return (ray_length > 0.0).then_some(SceneHit {
                    ray_length,
                    normal,
                    reflectance: PART_REFLECTANCE,
                });
            }
            let closing = slope_x * dir.x + slope_y * dir.y - dir.z;
            // Rounding may carry a step slightly below the surface; the step back is as short.
            let root = (closing * closing + bend * above).max(0.0).sqrt();
            ray_length += 2.0 * above / (closing + root);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn a_ray_stops_at_the_first_point_of_the_surface() {
        let axes = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, -1.0));
        let plate = Plate { axes, point_mm: Vector3::new(0.0, 0.0, 400.0) };
        let part = Freeform::seeded(plate, 100.0, &mut Pcg64::seed_from_u64(4));
        for (x, y) in (-10..=10).flat_map(|x| (-8..=8).map(move |y| (f64::from(x), f64::from(y)))) {
            let ray = Vector3::new(x / 80.0, y / 80.0 + 0.3, 1.0);
            let origin = Vector3::new(0.0, -120.0, 0.0);
            let above = |ray_length: f64| {
                let at = plate.local(&(origin + ray * ray_length - plate.point_mm));
                at.z - part.height_mm(at.x, at.y).0
            };
            let hit = part.hit(&origin, &ray).unwrap();
            assert!(above(hit.ray_length).abs() < 1e-9);
            let earlier = (0..2000).map(|idx| hit.ray_length * f64::from(idx) / 2000.0);
            assert!(earlier.into_iter().all(|ray_length| above(ray_length) > 0.0), "{x} {y}");
        }
    }
}
