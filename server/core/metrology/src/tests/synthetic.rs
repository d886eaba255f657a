//! Clouds of known surfaces viewed by a camera at the origin, with noise along the rays.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use scanning::{Cloud, CloudPoint};

/// Noise of the synthetic points along the ray, mm.
pub(crate) const SIGMA_MM: f64 = 0.03;

/// Table normal, towards the camera.
pub(crate) fn table_normal() -> Vector3<f64> {
    Vector3::new(0.02, -0.05, -1.0).normalize()
}

/// A point of the table.
pub(crate) const TABLE_POINT: Vector3<f64> = Vector3::new(0.0, 0.0, 400.0);

/// Intersection of a ray from the origin with the nearest of several surfaces: distance along the unit ray.
pub(crate) type Surface<'a> = &'a dyn Fn(&Vector3<f64>) -> Option<f64>;

/// Distance along a ray to a plane.
pub(crate) fn plane_hit(ray: &Vector3<f64>, point: &Vector3<f64>, normal: &Vector3<f64>) -> Option<f64> {
    let reach = point.dot(normal) / ray.dot(normal);
    (reach > 0.0).then_some(reach)
}

/// Distance along a ray to the near side of a sphere.
pub(crate) fn sphere_hit(ray: &Vector3<f64>, centre: &Vector3<f64>, radius: f64) -> Option<f64> {
    let along = ray.dot(centre);
    let rest = along * along - centre.norm_squared() + radius * radius;
    (rest > 0.0).then(|| along - rest.sqrt())
}

/// Distance along a ray to the near side of a cylinder of limited length about its point.
pub(crate) fn cylinder_hit(
    ray: &Vector3<f64>,
    point: &Vector3<f64>,
    axis: &Vector3<f64>,
    radius: f64,
    half_length: f64,
) -> Option<f64> {
    let across = |v: Vector3<f64>| v - axis * axis.dot(&v);
    let (r, p) = (across(*ray), across(*point));
    let (a, b) = (r.norm_squared(), r.dot(&p));
    let rest = b * b - a * (p.norm_squared() - radius * radius);
    let reach = (rest > 0.0).then(|| (b - rest.sqrt()) / a)?;
    (axis.dot(&(ray * reach - point)).abs() <= half_length).then_some(reach)
}

/// A scan of `surface` over ±`half_width_mm` across at the table, rays `pitch_mm` apart there.
///
/// Orders alternate line by line; neighbouring pixels are one column apart and their noise is independent.
pub(crate) fn scan(surface: Surface, half_width_mm: f64, pitch_mm: f64, sigma_mm: f64, seed: u64) -> Cloud {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let steps = (half_width_mm / pitch_mm) as i32;
    let mut points = Vec::new();
    for row in -steps..=steps {
        for column in -steps..=steps {
            let (x, y) = (f64::from(column) * pitch_mm, f64::from(row) * pitch_mm);
            let ray = Vector3::new(x, y, TABLE_POINT.z).normalize();
            let Some(reach) = surface(&ray) else { continue };
            let noise: f64 = rng.sample::<f64, _>(StandardNormal) * sigma_mm;
            points.push(point(&(ray * (reach + noise)), row, column, steps));
        }
    }
    Cloud { points, comments: vec!["noise_correlation_px 1".into()] }
}

fn point(position: &Vector3<f64>, row: i32, column: i32, steps: i32) -> CloudPoint {
    CloudPoint {
        x_mm: position.x,
        y_mm: position.y,
        z_mm: position.z,
        order: ((row + steps) % 5) as i8 - 2,
        frame: ((row + steps) / 5) as u32,
        u_px: (column + steps) as f32,
        v_px: 100.0,
        intensity: 100.0,
        sigma_mm: SIGMA_MM as f32,
    }
}

/// Adds outliers: a fraction of all points is moved up to `reach_mm` towards the camera.
pub(crate) fn with_outliers(mut cloud: Cloud, share: f64, reach_mm: f64, seed: u64) -> Cloud {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    for point in &mut cloud.points {
        if rng.random::<f64>() < share {
            let factor = 1.0 - rng.random_range(0.1..1.0) * reach_mm / point.z_mm;
            point.x_mm *= factor;
            point.y_mm *= factor;
            point.z_mm *= factor;
        }
    }
    cloud
}
