//! Each tool on surfaces with a closed form.

use nalgebra::Vector3;
use scanning::Cloud;

use super::synthetic::*;
use crate::*;

const GAUGE_MM: f64 = 8.9;
const RADIUS_MM: f64 = 18.9;

/// A block on a table; its top is smaller than the table.
pub(super) fn gauge(height_mm: f64, sigma_mm: f64, seed: u64) -> Cloud {
    let normal = table_normal();
    let top = TABLE_POINT + normal * height_mm;
    let on_top = |hit: &Vector3<f64>| (hit.x - 3.0).abs() < 11.0 && (hit.y + 2.0).abs() < 7.0;
    let surface = |ray: &Vector3<f64>| {
        let reach = plane_hit(ray, &top, &normal)?;
        if on_top(&(ray * reach)) { Some(reach) } else { plane_hit(ray, &TABLE_POINT, &normal) }
    };
    scan(&surface, 40.0, 0.4, sigma_mm, seed)
}

pub(super) fn ball(sigma_mm: f64, seed: u64) -> Cloud {
    let normal = table_normal();
    let centre = TABLE_POINT + normal * RADIUS_MM + Vector3::new(2.0, 1.0, 0.0);
    let surface =
        |ray: &Vector3<f64>| sphere_hit(ray, &centre, RADIUS_MM).or_else(|| plane_hit(ray, &TABLE_POINT, &normal));
    scan(&surface, 40.0, 0.4, sigma_mm, seed)
}

/// A cylinder of radius 9 mm on a table, and its axis.
fn rod_on_table() -> (Vector3<f64>, Vector3<f64>) {
    let normal = table_normal();
    (TABLE_POINT + normal * 9.0, Vector3::new(1.0, 0.4, 0.0).cross(&normal).normalize())
}

pub(super) fn rod(sigma_mm: f64, seed: u64) -> Cloud {
    let (point, axis) = rod_on_table();
    let surface = |ray: &Vector3<f64>| {
        cylinder_hit(ray, &point, &axis, 9.0, 20.0).or_else(|| plane_hit(ray, &TABLE_POINT, &table_normal()))
    };
    scan(&surface, 40.0, 0.45, sigma_mm, seed)
}

/// Two faces of 120° interior angle: normals 60° apart.
pub(super) fn roof(seed: u64) -> Cloud {
    let (left, right) = (
        Vector3::new(-(30f64.to_radians()).sin(), 0.0, -(30f64.to_radians()).cos()),
        Vector3::new((30f64.to_radians()).sin(), 0.0, -(30f64.to_radians()).cos()),
    );
    let surface = |ray: &Vector3<f64>| {
        let reach = |normal| plane_hit(ray, &TABLE_POINT, normal);
        Some(reach(&left)?.max(reach(&right)?))
    };
    scan(&surface, 30.0, 0.4, SIGMA_MM, seed)
}

/// The centres of two spheres of radius 12 mm on a table.
fn two_centres() -> [Vector3<f64>; 2] {
    let normal = table_normal();
    [Vector3::new(-18.0, 2.0, 0.0), Vector3::new(17.0, -3.0, 0.0)]
        .map(|offset| TABLE_POINT + offset - normal * normal.dot(&offset) + normal * 12.0)
}

pub(super) fn two_balls(seed: u64) -> Cloud {
    let centres = two_centres();
    let surface = |ray: &Vector3<f64>| {
        sphere_hit(ray, &centres[0], 12.0)
            .or_else(|| sphere_hit(ray, &centres[1], 12.0))
            .or_else(|| plane_hit(ray, &TABLE_POINT, &table_normal()))
    };
    scan(&surface, 40.0, 0.4, SIGMA_MM, seed)
}

fn request(tool: Tool, nominal_mm: Option<f64>) -> MeasureRequest {
    MeasureRequest { nominal_mm, ..MeasureRequest::new(tool) }
}

fn measured(cloud: &Cloud, tool: Tool, nominal_mm: Option<f64>) -> Measurement {
    measure(cloud, None, &request(tool, nominal_mm)).unwrap()
}

/// Fraction of seeds whose true value lies within U, and the mean error in units of its standard error.
fn coverage(tool: Tool, truth: f64, seeds: u64, cloud: impl Fn(u64) -> Cloud) -> (f64, f64) {
    let errors: Vec<(f64, f64)> = (0..seeds)
        .map(|seed| {
            let result = measured(&cloud(seed), tool, None);
            (result.value - truth, result.expanded_uncertainty)
        })
        .collect();
    let n = seeds as f64;
    let inside = errors.iter().filter(|(error, u)| error.abs() <= *u).count() as f64 / n;
    let mean = errors.iter().map(|e| e.0).sum::<f64>() / n;
    let standard = (errors.iter().map(|e| (e.1 / 2.0).powi(2)).sum::<f64>() / n).sqrt() / n.sqrt();
    (inside, mean / standard)
}

/// 30 seeds at 95.4 %: fewer than 25 inside has a probability of 0.4 %.
const MIN_COVERAGE: f64 = 25.0 / 30.0;

/// A mean of 30 seeds beyond 3.5 of its standard errors has a probability of 0.05 %.
const MAX_BIAS_SIGMAS: f64 = 3.5;

fn check_coverage(tool: Tool, truth: f64, cloud: impl Fn(u64) -> Cloud) {
    let (inside, bias) = coverage(tool, truth, 30, cloud);
    eprintln!("{tool}: {inside:.3} inside U, bias {bias:+.2} standard errors");
    assert!(inside >= MIN_COVERAGE, "{tool}: {inside} inside U");
    assert!(bias.abs() <= MAX_BIAS_SIGMAS, "{tool}: mean error {bias} standard errors");
}

#[test]
fn step_heights_are_unbiased_and_inside_their_uncertainty() {
    check_coverage(Tool::Step, GAUGE_MM, |seed| gauge(GAUGE_MM, SIGMA_MM, seed));
}

#[test]
fn sphere_radii_are_unbiased_and_inside_their_uncertainty() {
    check_coverage(Tool::Sphere, RADIUS_MM, |seed| ball(SIGMA_MM, seed));
}

#[test]
fn strong_noise_on_a_curved_surface_does_not_bias_its_radius() {
    // Bias grows with σ², its standard error with σ: at 0.1 mm a fit weighted by noisy normals is off by 5 of them.
    let (_, bias) = coverage(Tool::Sphere, RADIUS_MM, 12, |seed| ball(0.1, seed));
    assert!(bias.abs() <= MAX_BIAS_SIGMAS, "mean error {bias} standard errors");
}

#[test]
fn without_noise_every_tool_gives_the_closed_form() {
    /// Rounding of float64 at 400 mm over all points.
    const EXACT_MM: f64 = 1e-9;
    let step = measured(&gauge(GAUGE_MM, 0.0, 1), Tool::Step, None);
    assert!((step.value - GAUGE_MM).abs() < EXACT_MM, "{}", step.value);
    let sphere = measured(&ball(0.0, 1), Tool::Sphere, None);
    assert!((sphere.value - RADIUS_MM).abs() < EXACT_MM, "{}", sphere.value);
    let distance = measured(&gauge(GAUGE_MM, 0.0, 1), Tool::Distance, None);
    assert!((distance.value - GAUGE_MM).abs() < EXACT_MM, "{}", distance.value);
    let plane = measured(&gauge(GAUGE_MM, 0.0, 1), Tool::Plane, None);
    let truth = TABLE_POINT.dot(&table_normal()).abs();
    assert!((plane.value - truth).abs() < EXACT_MM, "{}", plane.value);
    let flatness = measured(&gauge(GAUGE_MM, 0.0, 1), Tool::Flatness, None);
    assert!(flatness.value < EXACT_MM, "{}", flatness.value);
}

#[test]
fn small_and_large_steps_and_pockets_are_found() {
    for height in [0.4, 2.0, 25.0, -3.0] {
        let step = measured(&gauge(height, SIGMA_MM, 5), Tool::Step, None);
        assert!((step.value - height).abs() < step.expanded_uncertainty * 1.5, "{height}: {}", step.value);
        assert_eq!(step.notes.iter().any(|note| note.contains("depth")), height < 0.0);
    }
}

#[test]
fn a_cylinder_on_a_table_is_found_without_a_hint_and_inside_its_uncertainty() {
    check_coverage(Tool::Cylinder, 9.0, |seed| rod(SIGMA_MM, seed));
    let result = measured(&rod(SIGMA_MM, 99), Tool::Cylinder, None);
    let (_, axis) = rod_on_table();
    let Shape::Cylinder { axis: found, .. } = result.features[0].shape else { panic!("no cylinder") };
    assert!(found.dot(&axis).abs() > 0.999_999, "{found}");
}

#[test]
fn the_angle_of_a_roof_is_read_on_the_side_of_the_nominal_value() {
    check_coverage(Tool::Angle, 60.0, roof);
    let interior = measured(&roof(1), Tool::Angle, Some(120.0));
    assert!((interior.value - 120.0).abs() < interior.expanded_uncertainty * 1.5);
    assert_eq!(interior.unit, Unit::Degree);
}

#[test]
fn two_spheres_are_measured_centre_to_centre() {
    let [first, second] = two_centres();
    check_coverage(Tool::Distance, (second - first).norm(), two_balls);
}

#[test]
fn flatness_is_the_band_of_the_form() {
    // A plate bent to a cylinder of sagitta 0.5 mm over ±40 mm: the residuals of a parabola about its plane
    // reach from −1/3 to +2/3 of the sagitta; 99.9 % of the points lie in all but a sliver of that band.
    let surface = |ray: &Vector3<f64>| {
        let flat = 400.0 / ray.z;
        let x = ray.x * flat;
        Some((400.0 - 0.5 * (x / 40.0).powi(2)) / ray.z)
    };
    let result = measured(&scan(&surface, 40.0, 0.4, 0.0, 3), Tool::Flatness, None);
    // The excluded border is 1 mm wide on each side: (39/40)² of the sagitta.
    assert!((result.value - 0.5 * (39.0f64 / 40.0).powi(2)).abs() < 0.02, "{}", result.value);
}

#[test]
fn outliers_are_counted_and_do_not_change_the_value() {
    let clean = measured(&gauge(GAUGE_MM, SIGMA_MM, 7), Tool::Step, None);
    let strayed = with_outliers(gauge(GAUGE_MM, SIGMA_MM, 7), 0.05, 6.0, 11);
    let result = measured(&strayed, Tool::Step, None);
    assert!((result.value - clean.value).abs() < clean.u_noise, "{} {}", result.value, clean.value);
    for (feature, before) in result.features.iter().zip(&clean.features) {
        let share = feature.n_outliers as f64 / (feature.n_points + feature.n_outliers) as f64;
        // Five in a hundred are outliers; the trim itself rejects one good point in 2000.
        assert!((0.04..0.06).contains(&share), "{}: {share}", feature.role);
        assert!(before.n_outliers as f64 <= 0.003 * before.n_points as f64, "{}", before.n_outliers);
    }
}

#[test]
fn points_at_the_edges_of_a_block_are_excluded() {
    // Within 0.8 mm of the block's edges every point is moved 0.4 mm down, like a stripe cut by an edge.
    let mut cloud = gauge(GAUGE_MM, SIGMA_MM, 3);
    let normal = table_normal();
    for point in &mut cloud.points {
        let height = normal.dot(&(Vector3::new(point.x_mm, point.y_mm, point.z_mm) - TABLE_POINT));
        let inside = (11.0 - (point.x_mm - 3.0).abs()).min(7.0 - (point.y_mm + 2.0).abs());
        if height > 5.0 && inside < 0.8 {
            point.z_mm += 0.06;
        }
    }
    let step = measured(&cloud, Tool::Step, None);
    assert!(
        (step.value - GAUGE_MM).abs() < step.expanded_uncertainty,
        "{} ± {}",
        step.value,
        step.expanded_uncertainty
    );
    assert!(step.features.iter().all(|feature| feature.n_border > 100), "{:?}", step.features);
}

#[test]
fn the_error_of_an_order_is_visible_in_its_row() {
    let mut cloud = gauge(GAUGE_MM, SIGMA_MM, 4);
    for point in cloud.points.iter_mut().filter(|p| p.order == 2 && p.z_mm < 395.0) {
        point.z_mm -= 0.02;
    }
    let step = measured(&cloud, Tool::Step, Some(GAUGE_MM));
    assert_eq!(step.per_order.iter().map(|row| row.order).collect::<Vec<_>>(), [-2, -1, 0, 1, 2]);
    for row in &step.per_order {
        let expected = if row.order == 2 { 0.02 } else { 0.0 };
        // 3.5σ of the mean of ≈ 600 points with 0.03 mm each.
        assert!((row.errors.mean_mm - expected).abs() < 0.0045, "{row:?}");
        assert!((row.errors.rmse_mm - SIGMA_MM.hypot(expected)).abs() < 0.004, "{row:?}");
        assert_eq!(row.value_mm, Some(GAUGE_MM + row.errors.mean_mm));
    }
    let total: usize = step.per_order.iter().map(|row| row.errors.n_points).sum();
    assert_eq!((total, total), (step.errors.n_points, step.features[1].n_points));
}

#[test]
fn every_order_of_a_sphere_has_its_own_centre_and_radius() {
    let sphere = measured(&ball(SIGMA_MM, 2), Tool::Sphere, Some(RADIUS_MM));
    assert_eq!(sphere.per_order.len(), 5);
    let Shape::Sphere { centre_mm, .. } = sphere.features[0].shape else { panic!("no sphere") };
    for row in &sphere.per_order {
        assert!((row.value_mm.unwrap() - RADIUS_MM).abs() < 0.05, "{row:?}");
        assert!((Vector3::from(row.centre_mm.unwrap()) - centre_mm).norm() < 0.08, "{row:?}");
        assert!(row.errors.max_mm < 0.15 && row.errors.rmse_mm < 1.1 * SIGMA_MM, "{row:?}");
    }
}

#[test]
fn the_nominal_value_selects_but_does_not_bias() {
    let free = measured(&gauge(GAUGE_MM, SIGMA_MM, 6), Tool::Step, None);
    let hinted = measured(&gauge(GAUGE_MM, SIGMA_MM, 6), Tool::Step, Some(9.5));
    assert!((free.value - hinted.value).abs() < 0.2 * free.u_noise, "{} {}", free.value, hinted.value);
    assert!((hinted.error.unwrap() - (hinted.value - 9.5)).abs() < 1e-15);
}

#[test]
fn the_verdict_weighs_error_against_tolerance_and_uncertainty() {
    let (cloud, calibration) = super::station::gauge_scan(GAUGE_MM, 8);
    let u = measure(&cloud, Some(&calibration), &request(Tool::Step, None)).unwrap().expanded_uncertainty;
    let with = |nominal: f64, tolerance: f64| {
        let request = MeasureRequest { tolerance_mm: Some(tolerance), ..request(Tool::Step, Some(nominal)) };
        measure(&cloud, Some(&calibration), &request).unwrap().verdict.unwrap()
    };
    assert_eq!(with(8.9, 0.1), Verdict::Pass);
    assert_eq!(with(9.1, 0.1), Verdict::Fail);
    assert_eq!(with(8.9, u / 2.0), Verdict::Undecided);
}

#[test]
fn a_region_limits_the_points_and_the_result_does_not_depend_on_chance() {
    let cloud = gauge(GAUGE_MM, SIGMA_MM, 9);
    let region = Region::between([-8.0, -9.0, 380.0], [14.0, 5.0, 395.0]);
    let top = MeasureRequest { region: Some(region), ..MeasureRequest::new(Tool::Plane) };
    let result = measure(&cloud, None, &top).unwrap();
    let truth = (TABLE_POINT + table_normal() * GAUGE_MM).dot(&table_normal()).abs();
    assert!((result.value - truth).abs() < 0.02, "{}", result.value);
    assert_eq!(measure(&cloud, None, &top), measure(&cloud, None, &top));
}

#[test]
fn clouds_without_sigma_are_measured_with_the_scatter_of_their_residuals() {
    let mut cloud = gauge(GAUGE_MM, SIGMA_MM, 10);
    let known = measured(&cloud, Tool::Step, None);
    cloud.points.iter_mut().for_each(|point| point.sigma_mm = 0.0);
    let unknown = measured(&cloud, Tool::Step, None);
    assert!((unknown.value - known.value).abs() < known.u_noise);
    assert!((unknown.u_noise / known.u_noise - 1.0).abs() < 0.1, "{} {}", unknown.u_noise, known.u_noise);
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let nothing = measure(&Cloud::default(), None, &MeasureRequest::new(Tool::Step));
    assert!(matches!(nothing, Err(MeasureError::TooFewPoints { got: 0, .. })));
    let normal = table_normal();
    let table = scan(&|ray| plane_hit(ray, &TABLE_POINT, &normal), 30.0, 0.4, SIGMA_MM, 1);
    for tool in [Tool::Step, Tool::Sphere, Tool::Cylinder, Tool::Angle, Tool::Distance] {
        let result = measure(&table, None, &MeasureRequest::new(tool));
        assert!(matches!(result, Err(MeasureError::FeatureNotFound { .. })), "{tool}: {result:?}");
    }
    let bad = MeasureRequest { tolerance_mm: Some(f64::NAN), ..MeasureRequest::new(Tool::Plane) };
    assert!(matches!(measure(&table, None, &bad), Err(MeasureError::BadNumber { .. })));
}

/// `cargo test --release -- --ignored --nocapture speed` prints the times.
#[test]
#[ignore = "a clock on a shared machine proves nothing"]
fn speed_of_a_measurement_of_three_hundred_thousand_points() {
    let normal = table_normal();
    let centre = TABLE_POINT + normal * RADIUS_MM;
    let surface =
        |ray: &Vector3<f64>| sphere_hit(ray, &centre, RADIUS_MM).or_else(|| plane_hit(ray, &TABLE_POINT, &normal));
    let cloud = scan(&surface, 40.0, 0.146, SIGMA_MM, 1);
    for tool in [Tool::Sphere, Tool::Plane, Tool::Cylinder, Tool::Flatness, Tool::Angle] {
        let start = std::time::Instant::now();
        let found = measure(&cloud, None, &MeasureRequest::new(tool)).is_ok();
        eprintln!(
            "{tool} ({found}) on {} points: {:.0} ms",
            cloud.points.len(),
            start.elapsed().as_secs_f64() * 1e3
        );
    }
    let (cloud, calibration) = super::station::gauge_scan(GAUGE_MM, 1);
    let start = std::time::Instant::now();
    measure(&cloud, Some(&calibration), &MeasureRequest::new(Tool::Step)).unwrap();
    eprintln!(
        "step with calibration on {} points: {:.0} ms",
        cloud.points.len(),
        start.elapsed().as_secs_f64() * 1e3
    );
}
