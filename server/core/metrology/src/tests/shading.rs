//! The shaded side of a ball: a thick sheet of light is brighter towards the projector, which moves its centre. Not
//! covered: the size of the shift on a rendered or real ball; here it is applied by its formula.

use nalgebra::Vector3;
use optics::PointMm;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::synthetic::{TABLE_POINT, plane_hit, scan, sphere_hit, table_normal};
use crate::fitting::features::Search;
use crate::fitting::sample::Samples;
use crate::interface::shape::Shape;

const RADIUS_MM: f64 = 18.9;

/// The projector of the paper's geometry: 174 mm above the camera.
const LIGHT_ORIGIN_MM: Vector3<f64> = Vector3::new(0.0, -174.0, 11.0);

/// Outward shift of the surface where its shaded side is lit at 45° across the line (inward on the side facing the
/// projector), mm; it grows with the square of the tangent, as on rendered balls.
const SHIFT_AT_45_MM: f64 = 0.008;

/// Accepted error of a ball's radius; the shift at the light's limit (tangent 1.5) is twice that.
const RADIUS_TOLERANCE_MM: f64 = 0.010;

/// The fitted radius, with the light's position known or unknown.
fn radius_mm(light_origin_mm: Option<Vector3<f64>>) -> f64 {
    let centre = Vector3::new(1.0, -2.0, TABLE_POINT.z - RADIUS_MM);
    let seen = |ray: &Vector3<f64>| {
        let Some(reach) = sphere_hit(ray, &centre, RADIUS_MM) else {
            return plane_hit(ray, &TABLE_POINT, &table_normal());
        };
        let normal = (ray * reach - centre) / RADIUS_MM;
        let to_light = (LIGHT_ORIGIN_MM - ray * reach).normalize();
        let cosine = normal.dot(&to_light);
        let across = (Vector3::y() - normal * normal.y).normalize();
        let tangent = -to_light.dot(&across) / cosine;
        let shift_mm = SHIFT_AT_45_MM * tangent * tangent.abs();
        (cosine > 0.2).then_some(reach - shift_mm / normal.dot(ray).abs().max(0.3))
    };
    let light_in_camera = light_origin_mm.map(PointMm::new);
    let cloud = scan(&seen, 26.0, 0.3, 0.0, 3);
    let samples = Samples::from_cloud(&cloud, None, light_in_camera);
    let mut search = Search { samples: &samples, rng: Pcg64Mcg::seed_from_u64(1) };
    let candidates = search.off_table();
    let Shape::Sphere { radius_mm, .. } = search.sphere("sphere", &candidates, Some(RADIUS_MM)).unwrap().shape
    else {
        panic!("not a sphere");
    };
    radius_mm
}

#[test]
fn the_shaded_side_does_not_enlarge_a_ball_whose_light_is_known() {
    let (unlit, lit) = (radius_mm(None) - RADIUS_MM, radius_mm(Some(LIGHT_ORIGIN_MM)) - RADIUS_MM);
    assert!(lit.abs() < RADIUS_TOLERANCE_MM, "radius off by {lit} mm");
    assert!(unlit.abs() > RADIUS_TOLERANCE_MM, "the shift of {unlit} mm is too small to test anything");
}

#[test]
fn the_position_of_the_light_selects_the_points_of_a_curved_feature() {
    // So a calibration, which states the position, changes the value of a ball as well as its uncertainty.
    assert_ne!(radius_mm(None), radius_mm(Some(LIGHT_ORIGIN_MM)));
}
