//! Effects on lines on a curved surface: of the thickness of the light sheet, and of averaging along the line.
//!
//! A sheet of thickness s lights a strip; on a curved surface the strip's flanks are deeper than its middle, so its
//! image is skewed and its centre is displaced. With n the surface's normal, N the sheet's, D the ray's direction, R
//! the radius across the strip, the flanks are deeper by τ²/2R with τ² = s²/(1 − (N·n)²), which moves the measured
//! point on the sheet against n by δ = τ²/2R · (1 − (N·n)(n·D)/(N·D)). A centre that follows the peak of the light is not
//! affected, a centroid is affected by 3δ (`docs/maths/metrology.md`).

use nalgebra::Vector3;
use scanning::Cloud;

use crate::interface::shape::Shape;
use crate::params::{BEND_SIGMAS, FOOTPRINT_FACTOR, LINE_SIGMA_KEY, MIN_COSINE};

/// Thickness of the light sheets as stated by the scan (one σ, mm).
pub(crate) fn line_sigma_mm(cloud: &Cloud) -> Option<f64> {
    cloud
        .comments
        .iter()
        .find_map(|comment| comment.trim().strip_prefix(LINE_SIGMA_KEY)?.trim().parse().ok())
        .filter(|mm: &f64| mm.is_finite() && *mm > 0.0)
}

/// Correction of a point along the outward normal, mm; 0 on a plane.
pub(crate) fn footprint_mm(
    shape: &Shape,
    position: &Vector3<f64>,
    ray: &Vector3<f64>,
    sheet_normal: &Vector3<f64>,
    line_sigma_mm: f64,
) -> f64 {
    let normal = shape.normal_at(position);
    let to_sheet = sheet_normal.dot(&normal);
    let across_square = (1.0 - to_sheet * to_sheet).max(MIN_COSINE * MIN_COSINE);
    let across = (sheet_normal - normal * to_sheet).normalize();
    let sag = line_sigma_mm * line_sigma_mm / across_square * shape.curvature_along(&across) / 2.0;
    let through = sheet_normal.dot(ray);
    let through = if through.abs() < MIN_COSINE { MIN_COSINE.copysign(through) } else { through };
    FOOTPRINT_FACTOR * sag * (1.0 - to_sheet * normal.dot(ray) / through)
}

/// Displacement along the outward normal by one σ of what averaging along a line leaves where its curvature changes: on a
/// circle nothing at the top, most on the flanks, and nothing on a line along a cylinder. `noise_mm`: σ of the point
/// along its ray.
pub(crate) fn bend_mm(
    shape: &Shape,
    position: &Vector3<f64>,
    ray: &Vector3<f64>,
    sheet_normal: &Vector3<f64>,
    noise_mm: f64,
) -> f64 {
    let largest = shape.largest_curvature();
    if largest == 0.0 {
        return 0.0;
    }
    let normal = shape.normal_at(position);
    let along = sheet_normal.cross(&normal).try_normalize(0.0).unwrap_or_default();
    let oblique = ray.dot(&along);
    BEND_SIGMAS * noise_mm * ray.dot(&normal).abs() * oblique * oblique * shape.curvature_along(&along) / largest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_under_a_frontal_sheet_is_displaced_by_the_sag_of_the_strip() {
        let shape = Shape::Sphere { centre_mm: Vector3::new(0.0, 0.0, 400.0), radius_mm: 20.0 };
        let top = Vector3::new(0.0, 0.0, 380.0);
        // The sheet is perpendicular to the surface (N ⟂ n), viewed at 30°: the factor of the view is one, the sag
        // s²/2R = 4 µm.
        let ray = Vector3::new(0.0, 0.5, 0.75f64.sqrt());
        let pull = footprint_mm(&shape, &top, &ray, &Vector3::y(), 0.4);
        assert!((pull - FOOTPRINT_FACTOR * 0.004).abs() < 1e-12, "{pull}");
    }

    #[test]
    fn a_line_across_a_rod_bends_on_its_flanks_and_one_along_it_does_not() {
        let rod = |axis: Vector3<f64>| Shape::Cylinder { point_mm: Vector3::zeros(), axis, radius_mm: 5.0 };
        let at = |angle: f64| Vector3::new(0.0, 5.0 * angle.sin(), 5.0 * angle.cos());
        let bend = |axis, angle| bend_mm(&rod(axis), &at(angle), &-Vector3::z(), &Vector3::x(), 0.02);
        assert_eq!(bend(Vector3::x(), 0.0), 0.0);
        let flank = std::f64::consts::FRAC_PI_4;
        assert!((bend(Vector3::x(), flank) - BEND_SIGMAS * 0.02 * 0.5 * 0.5f64.sqrt()).abs() < 1e-12);
        let along = bend_mm(&rod(Vector3::y()), &Vector3::new(0.0, 3.0, 5.0), &-Vector3::z(), &Vector3::x(), 0.02);
        assert_eq!(along, 0.0);
    }

    #[test]
    fn a_plane_is_not_displaced() {
        let shape = Shape::Plane { point_mm: Vector3::new(0.0, 0.0, 400.0), normal: Vector3::z() };
        assert_eq!(footprint_mm(&shape, &Vector3::new(0.0, 0.0, 400.0), &Vector3::z(), &Vector3::y(), 0.4), 0.0);
    }
}
