//! Figures of artefacts with known form, size and distance. The scans are those of a camera at the origin, without a
//! calibration's errors: those of a station are in the end-to-end tests.

use nalgebra::Vector3;

use super::*;
use crate::tests::station::station;
use crate::tests::synthetic::{SIGMA_MM, TABLE_POINT, plane_hit, scan, sphere_hit, table_normal, with_outliers};
use crate::{MeasureError, params};

const BALL: Vector3<f64> = Vector3::new(2.0, -3.0, 385.0);
const RADIUS_MM: f64 = 15.0;

fn plan() -> AcceptancePlan {
    AcceptancePlan {
        sphere: Some(SphereTest {
            artefact: "ball".to_owned(),
            diameter_mm: 2.0 * RADIUS_MM,
            uncertainty_mm: 0.001,
            form_mm: 0.0,
            expansion_per_k: params::EXPANSION_PER_K,
            mpe_form_mm: None,
            mpe_form_d95_mm: None,
            mpe_size_mm: None,
        }),
        sphere_pair: Some(SpherePairTest {
            artefact: "bar".to_owned(),
            distance_mm: 40.0,
            uncertainty_mm: 0.001,
            diameter_mm: 20.0,
            expansion_per_k: params::EXPANSION_PER_K,
            mpe_spacing_mm: None,
        }),
        ..AcceptancePlan::default()
    }
}

fn probed(cloud: &scanning::Cloud, procedure: Procedure) -> Figures {
    probe(cloud, &station(), &plan(), &ProbeRequest { procedure, region: None, seed: 1 }).unwrap()
}

fn ball_on_table(ray: &Vector3<f64>) -> Option<f64> {
    sphere_hit(ray, &BALL, RADIUS_MM).or_else(|| plane_hit(ray, &TABLE_POINT, &table_normal()))
}

#[test]
fn a_ball_has_its_size_and_the_dispersion_of_its_noise() {
    const SEEDS: u64 = 4;
    let balls: Vec<Ball> = (0..SEEDS)
        .map(|seed| match probed(&scan(&ball_on_table, 30.0, 0.25, SIGMA_MM, seed), Procedure::Sphere) {
            Figures::Ball(ball) => ball,
            other => panic!("no ball: {other:?}"),
        })
        .collect();
    let ball = &balls[0];
    let n = ball.dispersion.n_points as f64;
    // The radius over a cap of half-angle α = 53°: u = 6.71 σ/(√n α²).
    let u_mm = 6.71 * SIGMA_MM / (n.sqrt() * 0.927f64.powi(2));
    let error_mm = |ball: &Ball| ball.diameter_mm / 2.0 - RADIUS_MM;
    assert!(balls.iter().all(|ball| error_mm(ball).abs() < 4.0 * u_mm), "{balls:?}");
    let mean_mm = balls.iter().map(error_mm).sum::<f64>() / SEEDS as f64;
    assert!(mean_mm.abs() < 3.0 * u_mm / (SEEDS as f64).sqrt(), "{mean_mm} {u_mm}");
    assert!((Vector3::from(ball.centre_mm) - BALL).norm() < 4.0 * u_mm, "{ball:?}");
    assert_eq!(ball.dispersion.n_rejected, (0.003 * n) as usize);
    // Along the normal the noise is σ·cos: 95 % lie within ±1.96 σ of the frontal and less of the steep points.
    let frontal_mm = 2.0 * 1.96 * SIGMA_MM;
    assert!((0.6 * frontal_mm..1.05 * frontal_mm).contains(&ball.dispersion.d95_mm), "{ball:?}");
    // Without 3 ‰, all lie within about ±3 σ.
    let range_mm = ball.dispersion.range_mm;
    assert!((4.0 * SIGMA_MM..6.5 * SIGMA_MM).contains(&range_mm), "{ball:?}");
    assert_eq!(ball.per_order.iter().map(|row| row.order).collect::<Vec<_>>(), [-2, -1, 0, 1, 2]);
}

#[test]
fn three_in_a_thousand_outliers_are_left_out_and_more_are_not() {
    let range_mm = |share: f64| {
        let cloud = with_outliers(scan(&ball_on_table, 30.0, 0.25, SIGMA_MM, 7), share, 3.0, 5);
        let Figures::Ball(ball) = probed(&cloud, Procedure::Sphere) else { panic!("no ball") };
        ball.dispersion
    };
    assert!(range_mm(0.0005).range_mm < 7.0 * SIGMA_MM, "{:?}", range_mm(0.0005));
    let many = range_mm(0.02);
    assert!(many.range_mm > 1.0, "{many:?}");
    // The band of 95 % does not see 2 % of outliers.
    assert!(many.d95_mm < 6.0 * SIGMA_MM, "{many:?}");
}

#[test]
fn a_lobed_ball_shows_its_form() {
    // r = R + a·cos(3φ) about the direction to the camera: a form error of 2a.
    let amplitude_mm = 0.1;
    let lobed = |ray: &Vector3<f64>| {
        let mut reach = sphere_hit(ray, &BALL, RADIUS_MM)?;
        for _ in 0..5 {
            let outward = ray * reach - BALL;
            let azimuth = outward.y.atan2(outward.x);
            let steep = outward.xy().norm() / RADIUS_MM;
            let radius = RADIUS_MM + amplitude_mm * steep.powi(3) * (3.0 * azimuth).cos();
            reach = sphere_hit(ray, &BALL, radius)?;
        }
        Some(reach)
    };
    let on_table = |ray: &Vector3<f64>| lobed(ray).or_else(|| plane_hit(ray, &TABLE_POINT, &table_normal()));
    let cloud = scan(&on_table, 30.0, 0.25, 0.0, 7);
    let Figures::Ball(ball) = probed(&cloud, Procedure::Sphere) else { panic!("no ball") };
    // The lobes are evaluated up to 53° from the ray, which meets the ball there 1.8° off the axis of the camera. The 3 ‰
    // that are left out lie on their tops: 4 % of the height.
    let polar_rad = 0.6f64.acos() - 12.0 / 376.0;
    let expected_mm = 2.0 * amplitude_mm * polar_rad.sin().powi(3);
    assert!((0.94..1.0).contains(&(ball.dispersion.range_mm / expected_mm)), "{ball:?} {expected_mm}");
    assert!((ball.diameter_mm - 2.0 * RADIUS_MM).abs() < 0.005, "{ball:?}");
}

#[test]
fn two_balls_have_the_distance_of_their_centres() {
    let (a, b) = (Vector3::new(-20.0, 1.0, 388.0), Vector3::new(20.0, 1.0, 388.0));
    let bar = |ray: &Vector3<f64>| {
        let balls = sphere_hit(ray, &a, 10.0).or_else(|| sphere_hit(ray, &b, 10.0));
        balls.or_else(|| plane_hit(ray, &TABLE_POINT, &table_normal()))
    };
    let cloud = scan(&bar, 35.0, 0.25, SIGMA_MM, 9);
    let Figures::Pair { distance_mm, balls } = probed(&cloud, Procedure::SpherePair) else { panic!("no pair") };
    assert!((distance_mm - 40.0).abs() < 0.01, "{distance_mm}");
    assert!(balls.iter().all(|ball| (ball.diameter_mm - 20.0).abs() < 0.02), "{balls:?}");
}

#[test]
fn a_wavy_plate_shows_its_form_and_repeated_scans_their_noise() {
    // Two whole periods of ±20 µm across the plate.
    let amplitude_mm = 0.02;
    let wavy = |ray: &Vector3<f64>| {
        let flat = plane_hit(ray, &TABLE_POINT, &Vector3::new(0.0, 0.0, -1.0))?;
        let at = ray * flat;
        Some(flat + amplitude_mm * (std::f64::consts::TAU * at.x / 20.0).cos() / ray.z)
    };
    let exact = scan(&wavy, 20.0, 0.4, 0.0, 1);
    let Figures::Plate(plate) = probed(&exact, Procedure::Plate) else { panic!("no plate") };
    assert!((plate.dispersion.range_mm - 2.0 * amplitude_mm).abs() < 0.001, "{plate:?}");

    let [first, second] = [11, 12].map(|seed| scan(&wavy, 20.0, 0.4, SIGMA_MM, seed));
    let Figures::Plate(plate) = probed(&first, Procedure::Repeatability) else { panic!("no plate") };
    // The wave is in both scans and drops out: what is left is √2 of the noise. 10,000 points: 3σ of its estimate is 2 %.
    let rms_mm = repeat_difference_mm(&first, &second, &plate).unwrap();
    assert!((rms_mm / (2f64.sqrt() * SIGMA_MM) - 1.0).abs() < 0.03, "{rms_mm}");
    // Other settings: the lines are not the same.
    let mut other = second;
    other.points.iter_mut().for_each(|point| point.frame += 1000);
    let refused = repeat_difference_mm(&first, &other, &plate);
    assert!(matches!(refused, Err(MeasureError::TooFewPoints { .. })), "{refused:?}");
}
