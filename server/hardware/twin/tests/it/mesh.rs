//! A mesh renders like the shape that it approximates.
//!
//! The mesh of a ball and the analytic ball share the light, but not the ray intersection. Not covered: that the
//! analytic form is right; `conventions.rs` compares it with the truth.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nalgebra::Vector3;
use twin::{Renderer, Scene, SceneKind, Solid, StationModel, StationShape};
use vision::GreyImage;

const RADIUS_MM: f64 = 18.9;

/// Rings and sectors: sides of 0.25 mm, so that the flat triangles lie less than 0.25²/(4·18.9) = 0.0008 mm inside.
const RINGS: usize = 240;
const SECTORS: usize = 480;

/// Rows to either side of a true centre; wider than a line, narrower than the gap between two.
const HALF_PX: i64 = 6;

/// 0.0008 mm of depth at 0.64 mm per pixel and a slope of the line of some 0.3, and facets that change the level by 1 %
/// over a line of 1.6 px.
const CENTRE_TOLERANCE_PX: f64 = 0.02;

fn ball_of_triangles() -> Vec<[[f64; 3]; 3]> {
    let at = |ring: usize, sector: usize| {
        let (polar, azimuth) = (PI * ring as f64 / RINGS as f64, TAU * sector as f64 / SECTORS as f64);
        [polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()].map(|x| x * RADIUS_MM)
    };
    let patches = (0..RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| (ring, sector)));
    patches
        .flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect()
}

/// Centroid of the light around a row, and its sum.
fn centroid_px(image: &GreyImage, u: usize, v: i64) -> (f64, f64) {
    let level = |k: i64| f64::from(image.at(u, (v + k) as usize)) - 257.0 * f64::from(twin::params::BLACK_LEVEL);
    let sum: f64 = (-HALF_PX..=HALF_PX).map(level).sum();
    ((-HALF_PX..=HALF_PX).map(|k| level(k) * k as f64).sum::<f64>() / sum, sum)
}

#[test]
fn lines_on_a_ball_of_triangles_lie_where_they_lie_on_a_ball() {
    let shape =
        StationShape { width_px: 320, height_px: 256, bits: 16, line_sigma_px: 1.6, ..StationShape::default() };
    let model = StationModel::seeded(11, &shape).unwrap();
    let renderer = Renderer::without_noise(&model);
    let triangles = Scene::mesh(Arc::new(Solid::new(&ball_of_triangles()).unwrap()), &model, 1);
    let Scene::Mesh(mesh) = &triangles else { panic!("a mesh was requested") };
    let Scene::Sphere(mut ball) = (SceneKind::Sphere { radius_mm: RADIUS_MM }).placed(&model, 1) else {
        panic!("a ball was requested")
    };
    // The mesh is placed over the plate's origin.
    ball.plate = mesh.plate;
    ball.centre_mm = mesh.plate.point_mm + mesh.plate.normal() * RADIUS_MM;
    let mut compared = 0;
    for position_mm in [-6.0, 0.0, 5.0] {
        let by_form = renderer.laser_image(&Scene::Sphere(ball), position_mm, 0);
        let by_triangles = renderer.laser_image(&triangles, position_mm, 0);
        for point in renderer.truth_points(&Scene::Sphere(ball), position_mm) {
            let on_stage = point.hit_in_camera_mm - *model.motion(position_mm).shift_mm();
            let from_centre: Vector3<f64> = on_stage - ball.centre_mm;
            // The upper part of the ball: near its rim a line is parallel to the view and its centroid means little.
            let on_cap = from_centre.norm() < RADIUS_MM + 1e-6 && -from_centre.z > 0.6 * RADIUS_MM;
            let (u, v) = (point.u_px.round() as usize, point.v_px.round() as i64);
            if !on_cap || v < HALF_PX || v + HALF_PX >= 256 || u >= 320 {
                continue;
            }
            let ((expected, light), (found, _)) = (centroid_px(&by_form, u, v), centroid_px(&by_triangles, u, v));
            assert!(light > 1000.0, "no light at {point:?}");
            assert!((found - expected).abs() < CENTRE_TOLERANCE_PX, "{position_mm} {point:?}: {found} {expected}");
            compared += 1;
        }
    }
    assert!(compared > 60, "{compared} columns compared");
}
