//! Effect of the thickness of the light sheet on lines on a curved surface.
//!
//! A sheet of thickness s lights a strip; on a curved surface the strip's flanks are deeper than its middle, so its
//! image is skewed and its centre is displaced. With n the surface's normal, N the sheet's, D the ray's direction, R
//! the radius across the strip, the flanks are deeper by τ²/2R with τ² = s²/(1 − (N·n)²), which moves the measured
//! point on the sheet against n by δ = τ²/2R · (1 − (N·n)(n·D)/(N·D)). A centre that follows the peak of the light is not
//! affected, a centroid is affected by 3δ (`docs/maths/metrology.md`).

use nalgebra::Vector3;
use scanning::Cloud;

use crate::interface::shape::Shape;
use crate::params::{FOOTPRINT_FACTOR, LINE_SIGMA_KEY, MIN_COSINE};

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
    fn a_plane_is_not_displaced() {
        let shape = Shape::Plane { point_mm: Vector3::new(0.0, 0.0, 400.0), normal: Vector3::z() };
        assert_eq!(footprint_mm(&shape, &Vector3::new(0.0, 0.0, 400.0), &Vector3::z(), &Vector3::y(), 0.4), 0.0);
    }
}
