//! Reasons against a verdict: unknown contributions to U, shapes that differ from the model, arcs too short, angles too
//! small. Not covered: how real parts deviate from their shapes.

use nalgebra::Vector3;
use scanning::Cloud;

use super::station::gauge_scan;
use super::surfaces::{ball, gauge, rod, roof, two_balls};
use super::synthetic::*;
use crate::*;

const GAUGE_MM: f64 = 8.9;

fn asked(tool: Tool, nominal_mm: f64, tolerance_mm: f64) -> MeasureRequest {
    MeasureRequest { nominal_mm: Some(nominal_mm), tolerance_mm: Some(tolerance_mm), ..MeasureRequest::new(tool) }
}

fn without(cloud: &Cloud, key: &str) -> Cloud {
    let comments = cloud.comments.iter().filter(|line| !line.starts_with(key)).cloned().collect();
    Cloud { comments, ..cloud.clone() }
}

#[test]
fn an_incomplete_uncertainty_decides_nothing_and_names_what_is_missing() {
    let (cloud, calibration) = gauge_scan(GAUGE_MM, 4);
    let mut noiseless = cloud.clone();
    noiseless.points.iter_mut().for_each(|point| point.sigma_mm = 0.0);
    for (cloud, calibration, missing) in [
        (cloud.clone(), Some(&calibration), vec![]),
        (cloud.clone(), None, vec![Missing::Calibration]),
        (without(&cloud, "line_sigma_mm"), Some(&calibration), vec![Missing::LineThickness]),
        (without(&cloud, "frame_positions_mm"), Some(&calibration), vec![Missing::StagePositions]),
        (without(&cloud, "stage_direction"), Some(&calibration), vec![Missing::StagePositions]),
        (noiseless, Some(&calibration), vec![Missing::PointNoise]),
    ] {
        // Decided if the stated uncertainty were complete: one far inside, one far outside.
        for (nominal_mm, complete) in [(GAUGE_MM, Verdict::Pass), (GAUGE_MM + 3.0, Verdict::Fail)] {
            let result = measure(&cloud, calibration, &asked(Tool::Step, nominal_mm, 1.0)).unwrap();
            let expected = if missing.is_empty() { complete } else { Verdict::Undecided };
            assert_eq!((result.verdict, &result.missing), (Some(expected), &missing));
            for part in &missing {
                assert!(result.notes.iter().any(|note| note.contains(&part.to_string())), "{:?}", result.notes);
            }
        }
    }
}

#[test]
fn the_right_tool_gives_no_findings() {
    let flat = gauge(GAUGE_MM, SIGMA_MM, 3);
    for (tool, cloud) in [
        (Tool::Plane, &flat),
        (Tool::Step, &flat),
        (Tool::Flatness, &flat),
        (Tool::Sphere, &ball(SIGMA_MM, 3)),
        (Tool::Cylinder, &rod(SIGMA_MM, 3)),
        (Tool::Angle, &roof(3)),
        (Tool::Distance, &two_balls(3)),
    ] {
        assert_eq!(measure(cloud, None, &MeasureRequest::new(tool)).unwrap().findings, [], "{tool}");
    }
}

#[test]
fn a_step_on_a_ball_is_reported_as_a_model_that_does_not_fit() {
    for seed in 0..5 {
        let result = measure(&ball(SIGMA_MM, seed), None, &asked(Tool::Step, 36.8, 1.0)).unwrap();
        assert!(
            result.findings.iter().any(|finding| matches!(
                finding,
                Finding::ModelMisfit { role: "top", .. } | Finding::OffSurface { role: "top", .. }
            )),
            "{} ± {}: {:?}",
            result.value,
            result.expanded_uncertainty,
            result.features
        );
        assert_eq!(result.verdict, Some(Verdict::Undecided));
        assert!(result.notes.iter().any(|note| note.contains("does not fit")));
    }
}

#[test]
fn a_pocket_is_not_a_boss() {
    let pocket = measure(&gauge(-3.0, SIGMA_MM, 5), None, &asked(Tool::Step, 3.0, 0.1)).unwrap();
    assert!((pocket.value + 3.0).abs() < 0.01 && (pocket.error.unwrap() + 6.0).abs() < 0.01, "{}", pocket.value);
    assert_eq!(
        verdict(pocket.error.unwrap(), &Limits::symmetric(0.1), pocket.expanded_uncertainty),
        Verdict::Fail
    );
    let asked_for = measure(&gauge(-3.0, SIGMA_MM, 5), None, &asked(Tool::Step, -3.0, 0.1)).unwrap();
    assert!(asked_for.error.unwrap().abs() < 0.01, "{}", asked_for.value);
}

#[test]
fn a_block_that_hides_most_of_its_table_is_still_measured_from_the_table() {
    let normal = table_normal();
    let top = TABLE_POINT + normal * GAUGE_MM;
    let surface = |ray: &Vector3<f64>| {
        let reach = plane_hit(ray, &top, &normal)?;
        let hit = ray * reach;
        let on_top = hit.x.abs() < 22.0 && hit.y.abs() < 22.0;
        if on_top { Some(reach) } else { plane_hit(ray, &TABLE_POINT, &normal) }
    };
    let step = measure(&scan(&surface, 30.0, 0.4, SIGMA_MM, 6), None, &MeasureRequest::new(Tool::Step)).unwrap();
    assert!((step.value - GAUGE_MM).abs() < 0.01, "{}", step.value);
    assert!(step.features[1].n_points > step.features[0].n_points, "{:?}", step.features);
}

#[test]
fn a_flat_plate_is_flat_within_its_uncertainty_however_noisy_it_is() {
    let normal = table_normal();
    for seed in 0..12 {
        let plate = scan(&|ray| plane_hit(ray, &TABLE_POINT, &normal), 30.0, 0.4, SIGMA_MM, seed);
        let flatness = measure(&plate, None, &MeasureRequest::new(Tool::Flatness)).unwrap();
        // The band itself is 6.6 σ wide, 0.2 mm.
        assert!(
            flatness.value <= flatness.expanded_uncertainty,
            "{} ± {}",
            flatness.value,
            flatness.expanded_uncertainty
        );
        assert!(flatness.expanded_uncertainty < 0.05, "{}", flatness.expanded_uncertainty);
        assert_eq!(flatness.nominal, Some(0.0));
    }
}

#[test]
fn the_form_of_a_noisy_plate_lies_within_its_uncertainty() {
    let bent = |ray: &Vector3<f64>| {
        let x = ray.x * 400.0 / ray.z;
        Some((400.0 - 0.5 * (x / 40.0).powi(2)) / ray.z)
    };
    for seed in 0..6 {
        let plate = scan(&bent, 40.0, 0.4, SIGMA_MM, seed);
        let flatness = measure(&plate, None, &MeasureRequest::new(Tool::Flatness)).unwrap();
        // The excluded border is 1.05 mm wide on each side.
        let truth = 0.5 * (38.95f64 / 40.0).powi(2);
        let error = flatness.value - truth;
        assert!(error.abs() <= flatness.expanded_uncertainty, "{error} ± {}", flatness.expanded_uncertainty);
    }
}

#[test]
fn the_excluded_border_is_three_thicknesses_of_the_sheet() {
    let n_border = |sheet_mm: f64| {
        let mut cloud = gauge(GAUGE_MM, SIGMA_MM, 3);
        cloud.comments.push(format!("line_sigma_mm {sheet_mm}"));
        measure(&cloud, None, &MeasureRequest::new(Tool::Step)).unwrap().features[1].n_border as f64
    };
    // A top of 22 mm × 14 mm, points 0.4 mm apart.
    for (sheet_mm, margin_mm) in [(0.2, 0.6), (0.3, 0.9), (0.5, 1.5)] {
        let expected = (22.0 * 14.0 - (22.0 - 2.0 * margin_mm) * (14.0 - 2.0 * margin_mm)) / 0.16;
        let ratio = n_border(sheet_mm) / expected;
        // At least the margin, and up to two cells of half of it or more.
        assert!((1.0..3.0).contains(&ratio), "{sheet_mm} mm: {ratio}");
    }
}

#[test]
fn a_short_arc_is_named() {
    // A rod of 40 mm with an arc of 40° above the table.
    let normal = table_normal();
    let axis = Vector3::new(1.0, 0.4, 0.0).cross(&normal).normalize();
    let point = TABLE_POINT - normal * 40.0 * 20f64.to_radians().cos();
    let surface = |ray: &Vector3<f64>| {
        let table = plane_hit(ray, &TABLE_POINT, &normal)?;
        Some(cylinder_hit(ray, &point, &axis, 40.0, 30.0).map_or(table, |rod| rod.min(table)))
    };
    let result =
        measure(&scan(&surface, 40.0, 0.45, SIGMA_MM, 1), None, &asked(Tool::Cylinder, 40.0, 20.0)).unwrap();
    let Some(Finding::ShortArc { arc_deg, .. }) = result.findings.first() else { panic!("{:?}", result.findings) };
    assert!((30.0..41.0).contains(arc_deg), "{arc_deg}");
    assert_eq!(result.verdict, Some(Verdict::Undecided));
}

/// A table and a block whose top is rotated relative to it by an angle about x.
fn tilted_block(angle_deg: f64, seed: u64) -> Cloud {
    let normal = table_normal();
    let top = TABLE_POINT + normal * 12.0;
    let turned = nalgebra::Rotation3::new(Vector3::x() * angle_deg.to_radians()) * normal;
    let surface = |ray: &Vector3<f64>| {
        let reach = plane_hit(ray, &top, &turned)?;
        let hit = ray * reach;
        let on_top = hit.x.abs() < 12.0 && hit.y.abs() < 12.0;
        if on_top { Some(reach) } else { plane_hit(ray, &TABLE_POINT, &normal) }
    };
    scan(&surface, 30.0, 0.5, SIGMA_MM, seed)
}

#[test]
fn angles_near_zero_are_unbiased_and_their_tilts_have_a_sign() {
    const SEEDS: u64 = 30;
    let mut inside = 0;
    let mut tilts = Vec::new();
    for seed in 0..SEEDS {
        let result = measure(&tilted_block(0.0, seed), None, &MeasureRequest::new(Tool::Angle)).unwrap();
        inside += usize::from(result.value <= result.expanded_uncertainty);
        tilts.extend(result.tilts_deg.unwrap().map(|tilt| tilt / (result.expanded_uncertainty / 2.0)));
    }
    // 30 of 95 %: fewer than 25 inside has a probability of 0.4 %.
    assert!(inside >= 25, "{inside} of {SEEDS}");
    let n = tilts.len() as f64;
    let mean = tilts.iter().sum::<f64>() / n;
    assert!(mean.abs() < 3.5 / n.sqrt(), "folded: {mean}");
    // Both signs, with the size of their uncertainty (60 normal values: 0.7–1.3, 99.8 %).
    let rms = (tilts.iter().map(|t| t * t).sum::<f64>() / n).sqrt();
    assert!((0.7..1.3).contains(&rms), "{rms}");
    let [about_x, about_y] =
        measure(&tilted_block(-2.0, 1), None, &MeasureRequest::new(Tool::Angle)).unwrap().tilts_deg.unwrap();
    assert!((about_x + 2.0).abs() < 0.05 && about_y.abs() < 0.05, "{about_x} {about_y}");
}
