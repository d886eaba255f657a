//! The tables compared with the exact solution.

use nalgebra::DMatrix;

use super::*;
use crate::calibration::DepthRangeMm;
use crate::camera::Camera;
use crate::grating::tests::grating;
use crate::plane::Plane;
use crate::surface::LightSurfaces;

/// Tolerance between the tables and the exact solution.
const AGREEMENT_MM: f64 = 1e-4;

fn station(distortion: &[f64], light: LightSurfaces) -> Calibration {
    let matrix = [[2518.4, 0.0, 635.2], [0.0, 2517.0, 501.6], [0.0, 0.0, 1.0]];
    Calibration {
        id: "test".to_owned(),
        camera: Camera::from_opencv(1280, 1024, matrix, distortion),
        orders: vec![-2, -1, 0, 1, 2],
        light,
        stage: None,
        depth_range_mm: DepthRangeMm { near_mm: 300.0, far_mm: 500.0 },
        covariance: DMatrix::zeros(0, 0),
    }
}

/// Pixels all over the image and slightly beyond, in sequence along slanted lines.
fn pixels() -> (Vec<f64>, Vec<f64>) {
    let rows = (0..40).map(|line| f64::from(line) * 26.3 - 0.5);
    rows.flat_map(|row| (0..1290).map(move |u| (f64::from(u) - 0.7, row + 0.07 * f64::from(u)))).unzip()
}

/// Largest distance between table and exact solution over all orders where both have a hit in the depth range, and
/// their number.
fn largest_difference(calibration: &Calibration) -> (f64, usize) {
    let triangulator = Triangulator::new(calibration.clone());
    let (u, v) = pixels();
    let (mut hits, mut largest, mut compared) = (Hits::default(), 0.0f64, 0);
    for (idx, order) in calibration.orders.iter().enumerate() {
        triangulator.triangulate_all(idx, &u, &v, &mut hits);
        for i in 0..u.len() {
            let exact = calibration.triangulate(*order, &Vector2::new(u[i], v[i]), None);
            assert_eq!(exact.is_some(), hits.z_mm[i].is_finite(), "order {order} at {} {}", u[i], v[i]);
            let Some(exact) = exact.filter(|hit| calibration.depth_range_mm.contains(hit.hit.depth_mm)) else {
                continue;
            };
            let found = nalgebra::Vector3::new(hits.x_mm[i], hits.y_mm[i], hits.z_mm[i]);
            largest = largest.max((found - exact.hit_in_camera.xyz).norm());
            let range = Vector2::new(hits.range_by_u[i], hits.range_by_v[i]);
            assert!((range - exact.range_by_pixel).norm() < 1e-4 * exact.range_by_pixel.norm());
            compared += 1;
        }
    }
    (largest, compared)
}

#[test]
fn tables_agree_with_the_exact_sheets_to_a_tenth_of_a_micrometre() {
    let (largest, compared) =
        largest_difference(&station(&[-0.097, 0.115, -1.5e-5, 1.2e-4, 0.02], LightSurfaces::Grating(grating())));
    assert!(largest < AGREEMENT_MM && compared > 50_000, "{largest} mm in {compared} points");
}

#[test]
fn where_a_cubic_does_not_fit_the_lens_the_exact_solution_is_used() {
    let strong = [-1.9, 9.0, 0.02, -0.03, -30.0];
    let calibration = station(&strong, LightSurfaces::Grating(grating()));
    let (largest, compared) = largest_difference(&calibration);
    assert!(largest < AGREEMENT_MM && compared > 50_000, "{largest} mm in {compared} points");
}

#[test]
fn planes_use_tables_too_and_their_horizon_is_exact() {
    // Tilted so far that rays in the upper part of the image miss it.
    let plane = Plane { normal: nalgebra::Vector3::new(0.01, 0.99, 0.03).normalize(), offset_mm: -12.0 };
    let light = LightSurfaces::Planes((-2..=2).map(|order| (order, plane)).collect());
    let mut calibration = station(&[-0.1], light);
    calibration.depth_range_mm = DepthRangeMm { near_mm: 10.0, far_mm: 2_000.0 };
    let (largest, compared) = largest_difference(&calibration);
    assert!(largest < 1e-3 && compared > 50_000, "{largest} mm in {compared} points");
}

#[test]
fn a_single_pixel_is_triangulated_as_in_a_list() {
    let triangulator = Triangulator::new(station(&[-0.097, 0.115], LightSurfaces::Grating(grating())));
    let (u, v) = pixels();
    let (mut many, mut one) = (Hits::default(), Hits::default());
    triangulator.triangulate_all(3, &u, &v, &mut many);
    for i in (0..u.len()).step_by(17).filter(|&i| many.z_mm[i].is_finite()) {
        triangulator.triangulate_all(3, &u[i..=i], &v[i..=i], &mut one);
        assert_eq!(one.at(0), many.at(i));
    }
}

#[test]
fn tables_filled_in_advance_equal_those_filled_on_demand() {
    let calibration = station(&[-0.097, 0.115], LightSurfaces::Grating(grating()));
    let (prefilled, on_demand) = (Triangulator::new(calibration.clone()), Triangulator::new(calibration));
    prefilled.fill();
    assert!(prefilled.cells.iter().all(|cell| cell.get().is_some()));
    let (u, v) = pixels();
    let (mut hits, mut expected) = (Hits::default(), Hits::default());
    prefilled.triangulate_all(2, &u, &v, &mut hits);
    on_demand.triangulate_all(2, &u, &v, &mut expected);
    for i in (0..u.len()).filter(|&i| expected.z_mm[i].is_finite()) {
        assert_eq!(hits.at(i), expected.at(i));
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let triangulator = Triangulator::new(station(&[-0.097, 0.115], LightSurfaces::Grating(grating())));
    let (u, v) = pixels();
    let (mut hits, mut depths_mm) = (Hits::default(), Vec::new());
    triangulator.triangulate_all(1, &u, &v, &mut hits);
    triangulator.depths(&u, &v, &mut depths_mm);
    let depths_mm = &depths_mm[u.len()..2 * u.len()];
    let mut compared = 0;
    for i in 0..u.len() {
        // Compiled for the baseline of this architecture, unlike the call above.
        let hit = triangulator.hit(1, u[i], v[i]);
        let depth_mm = hit.in_camera.xyz.z;
        if depth_mm.is_nan() {
            assert!(hits.z_mm[i].is_nan() && depths_mm[i].is_nan(), "at {} {}", u[i], v[i]);
            continue;
        }
        assert_eq!(hits.at(i), hit);
        assert_eq!(depths_mm[i], depth_mm);
        compared += 1;
    }
    assert!(compared > u.len() / 2, "{compared} of {}", u.len());
}
