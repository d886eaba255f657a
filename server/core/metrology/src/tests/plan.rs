//! A plan on a simulated station: every characteristic compared with the true geometry, on seeds with different poses, a
//! calibration sampled from its covariance, noise, and rims that fade over a blur.
//! Not covered: errors of real centrelines at rims and on shiny metal.

use nalgebra::Vector3;
use optics::{PartFrame, Rigid};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::shaped_scan::{ShapedScan, Surface, part_from_datum, shaped_scan};
use crate::evaluation::alignment::DatumFrame;
use crate::*;

/// Two blocks (8 and 6 mm high), one with a hole, one with a slot; a ball and a rod beside them.
pub(super) struct TestPart;

const HOLE: ([f64; 2], f64) = ([-12.0, 12.0], 5.0);
/// Centre, half distance of the ends' centres along x, radius.
const SLOT: ([f64; 2], f64, f64) = ([16.0, 15.0], 5.0, 2.5);
const BALL: ([f64; 3], f64) = ([0.0, -12.0, 6.0], 6.0);
/// Middle of the axis along x, radius; 16 mm long.
const ROD: ([f64; 3], f64) = ([17.0, -12.0, 4.0], 4.0);

impl Surface for TestPart {
    fn top(&self, x: f64, y: f64, grown_mm: f64) -> (f64, f64) {
        let mut seen = (0.0, f64::INFINITY);
        let hole = (x - HOLE.0[0]).hypot(y - HOLE.0[1]) - HOLE.1;
        let rim = (x + 24.0).min(-x).min(y).min(24.0 - y).min(hole);
        if rim > -grown_mm {
            seen = (8.0, rim);
        }
        let slot = ((x - SLOT.0[0]).abs().max(SLOT.1) - SLOT.1).hypot(y - SLOT.0[1]) - SLOT.2;
        let rim = (x - 6.0).min(27.0 - x).min(y - 4.0).min(26.0 - y).min(slot);
        if rim > -grown_mm {
            seen = (6.0, rim);
        }
        let square = BALL.1.powi(2) - (x - BALL.0[0]).powi(2) - (y - BALL.0[1]).powi(2);
        if square > 0.0 {
            seen = (BALL.0[2] + square.sqrt(), f64::INFINITY);
        }
        let square = ROD.1.powi(2) - (y - ROD.0[1]).powi(2);
        if square > 0.0 && (x - ROD.0[0]).abs() < 8.0 {
            seen = (ROD.0[2] + square.sqrt(), f64::INFINITY);
        }
        seen
    }
}

pub(super) fn boxed(min: [f64; 3], max: [f64; 3]) -> Value {
    json!({ "region": { "type": "box", "min_mm": min, "max_mm": max } })
}

/// A box about a place of the datum frame, in the part frame: for the features that the alignment rests on.
pub(super) fn boxed_in_part(pose: &Rigid<PartFrame, DatumFrame>, at: [f64; 3], [x, y, z]: [f64; 3]) -> Value {
    let at = pose.rotation * Vector3::from(at) + pose.translation_mm;
    // The datum frame's y runs along the camera's x.
    let half = [y, x, z];
    let corner = |sign: f64| [0, 1, 2].map(|k| at[k] + sign * half[k]);
    boxed(corner(-1.0), corner(1.0))
}

/// Aligned by the table (z = 0), the side of the first block (y = 0) and the ball (x = 0).
pub(super) fn test_plan(pose: &Rigid<PartFrame, DatumFrame>, characteristics: &[(Value, f64)]) -> Plan {
    let characteristics: Vec<Value> = characteristics
        .iter()
        .enumerate()
        .map(|(idx, (measure, _))| json!({ "id": idx.to_string(), "measure": measure }))
        .collect();
    let plan = json!({
        "format": "sheaf-plan/1",
        "features": [
            { "id": "table", "shape": { "type": "plane", "select": boxed_in_part(pose, [0.0; 3], [40.0, 40.0, 2.5]) } },
            { "id": "top", "shape": { "type": "plane", "select": boxed_in_part(pose, [-12.0, 12.0, 8.0], [14.0, 14.0, 1.5]) } },
            { "id": "side", "shape": { "type": "edge", "plane": "top",
                "select": boxed_in_part(pose, [-12.0, 0.0, 8.0], [10.0, 3.0, 2.0]) } },
            { "id": "ball", "shape": { "type": "sphere", "select": boxed_in_part(pose, [0.0, -12.0, 9.0], [6.5, 6.5, 6.0]) } },
            { "id": "hole", "shape": { "type": "circle", "plane": "top", "select": boxed([-19.0, 5.0, 7.0], [-5.0, 19.0, 9.0]) } },
            { "id": "low top", "shape": { "type": "plane", "select": boxed([6.0, 4.0, 5.5], [27.0, 26.0, 6.5]) } },
            { "id": "slot", "shape": { "type": "slot", "plane": "low top", "select": boxed([7.0, 10.0, 5.0], [25.0, 20.0, 7.0]) } },
            { "id": "left", "shape": { "type": "edge", "plane": "low top", "select": boxed([8.0, 2.0, 5.0], [25.0, 7.0, 7.0]) } },
            { "id": "rod", "shape": { "type": "cylinder", "radius_mm": 4.0, "select": boxed([9.0, -17.0, 3.0], [25.0, -7.0, 9.0]) } },
            { "id": "through", "shape": { "type": "point", "of": { "line_and_plane": ["hole axis", "table"] } } },
            { "id": "hole axis", "shape": { "type": "line", "of": { "axis": "hole" } } },
        ],
        "alignment": { "primary": "table", "secondary": "side", "tertiary": "ball" },
        "characteristics": characteristics,
    });
    let mut plan = plan;
    // A feature depends on those above it.
    plan["features"].as_array_mut().unwrap().swap(9, 10);
    Plan::from_json(&plan.to_string()).unwrap()
}

/// Characteristics with their true values.
pub(super) fn characteristics() -> Vec<(Value, f64)> {
    let [hx, hy] = HOLE.0;
    let [sx, sy] = SLOT.0;
    let ball_to_hole = Vector3::new(hx - BALL.0[0], hy - BALL.0[1], 8.0 - BALL.0[2]).norm();
    vec![
        (json!({ "type": "step", "base": "table", "top": "top" }), 8.0),
        (json!({ "type": "distance", "from": "top", "to": "low top" }), 2.0),
        (json!({ "type": "distance", "from": "ball", "to": "hole" }), ball_to_hole),
        (json!({ "type": "distance", "from": "table", "to": "ball" }), 6.0),
        (json!({ "type": "distance", "from": "side", "to": "left" }), 4f64.hypot(2.0)),
        (json!({ "type": "distance", "from": "side", "to": "left", "along": "y" }), 4.0),
        (json!({ "type": "angle", "from": "top", "to": "low top" }), 0.0),
        (json!({ "type": "angle", "from": "table", "to": "top", "about": "x" }), 0.0),
        (json!({ "type": "angle", "from": "rod", "to": "table" }), 90.0),
        (json!({ "type": "diameter", "of": "hole" }), 10.0),
        (json!({ "type": "radius", "of": "ball" }), 6.0),
        (json!({ "type": "diameter", "of": "rod" }), 8.0),
        (json!({ "type": "width", "of": "slot" }), 5.0),
        (json!({ "type": "length", "of": "slot" }), 15.0),
        (json!({ "type": "coordinate", "of": "hole", "axis": "x" }), hx),
        (json!({ "type": "coordinate", "of": "through", "axis": "y" }), hy),
        (json!({ "type": "position", "of": "hole", "at_mm": [hx, hy, null] }), 0.0),
        (json!({ "type": "position", "of": "slot", "at_mm": [sx - 0.3, sy + 0.4, null] }), 1.0),
        (json!({ "type": "flatness", "of": "top" }), 0.0),
        (json!({ "type": "parallelism", "of": "top", "to": "table" }), 0.0),
        (json!({ "type": "flush", "reference": "top", "surface": "low top", "at": "left" }), -2.0),
    ]
}

/// Error and U of every characteristic on one seed.
type Errors = Vec<(f64, f64)>;

/// Errors of a plan on many seeds; checks that its uncertainties are complete.
pub(super) fn errors_of(
    surface: &impl Surface,
    characteristics: &[(Value, f64)],
    plan: impl Fn(&Rigid<PartFrame, DatumFrame>) -> Plan + Sync,
    scan: &ShapedScan,
    seeds: u64,
) -> Vec<Errors> {
    (0..seeds)
        .into_par_iter()
        .map(|seed| {
            let pose = part_from_datum(seed);
            let (cloud, calibration) = shaped_scan(surface, &pose, seed, scan);
            let result = evaluate(&plan(&pose), &cloud, Some(&calibration), &Models::new()).unwrap();
            let of = |(result, (_, truth)): (&CharacteristicResult, &(Value, f64))| {
                assert!(result.failure.is_none(), "seed {seed}: {} {:?}", result.measure, result.failure);
                assert!(result.missing.is_empty(), "seed {seed}: {} {:?}", result.measure, result.missing);
                (result.value.unwrap() - truth, result.expanded_uncertainty.unwrap())
            };
            result.characteristics.iter().zip(characteristics).map(of).collect()
        })
        .collect()
}

/// Seeds of a default run, and of `cargo xtask campaign`.
pub(super) const FEW: u64 = 4;
pub(super) const MANY: u64 = 20;

/// Of twenty, fewer than 17 inside at 95 % has a probability of 0.3 %.
const LEAST_OF_MANY: f64 = 17.0 / 20.0;

/// Of 20 or more values on a few seeds; the errors of a seed are correlated by its calibration.
const LEAST_SHARE_OF_FEW: f64 = 0.85;

/// Checks every characteristic against its uncertainty. On many seeds: 93 % of all and 17 of 20 of each inside U, bias
/// below U/4 except for forms. On few: none further off than 2 U (four standard uncertainties), 85 % of all inside.
pub(super) fn check(characteristics: &[(Value, f64)], errors: &[Errors]) {
    let n = errors.len() as f64;
    let is_many = errors.len() as u64 >= MANY;
    let mut n_inside = 0.0;
    let mut broken = Vec::new();
    for (idx, (measure, truth)) in characteristics.iter().enumerate() {
        let of: Vec<(f64, f64)> = errors.iter().map(|errors| errors[idx]).collect();
        let inside = of.iter().filter(|(error, u)| error.abs() <= *u).count() as f64;
        let (bias, u) = (of.iter().map(|e| e.0).sum::<f64>() / n, of.iter().map(|e| e.1).sum::<f64>() / n);
        let rms = (of.iter().map(|e| (2.0 * e.0 / e.1).powi(2)).sum::<f64>() / n).sqrt();
        eprintln!(
            "{:>5.1} % inside, bias {bias:+.5}, U {u:.5}, normalised RMS {rms:.2}: {measure}",
            100.0 * inside / n
        );
        n_inside += inside;
        // Known limits of `docs/maths/metrology.md`: the mean of a non-negative value is positive where the truth is 0, and
        // a form is the mean of two noise corrections.
        let kind = measure["type"].as_str().unwrap();
        let is_folded = *truth == 0.0 && ["angle", "position"].contains(&kind);
        let is_form = ["flatness", "parallelism", "perpendicularity", "profile"].contains(&kind);
        let is_biased = is_many && bias.abs() >= u / 4.0 && !is_folded && !is_form;
        let is_far_off = of.iter().any(|(error, u)| error.abs() > 2.0 * u);
        if (is_many && inside < LEAST_OF_MANY * n) || is_biased || is_far_off {
            broken.push(measure.to_string());
        }
    }
    let share = n_inside / n / characteristics.len() as f64;
    eprintln!("{:.1} % of all inside", 100.0 * share);
    assert!(broken.is_empty(), "{broken:?}");
    assert!(share >= if is_many { 0.93 } else { LEAST_SHARE_OF_FEW }, "{share}");
}

fn check_all(seeds: u64) {
    let characteristics = characteristics();
    let plan = |pose: &Rigid<PartFrame, DatumFrame>| test_plan(pose, &characteristics);
    check(&characteristics, &errors_of(&TestPart, &characteristics, plan, &ShapedScan::FINE, seeds));
}

#[test]
fn every_characteristic_lies_inside_its_uncertainty() {
    check_all(FEW);
}

#[test]
#[ignore = "half a minute: cargo xtask campaign"]
fn campaign_of_all_characteristics() {
    check_all(MANY);
}

#[test]
fn centres_lie_at_their_true_positions() {
    let scans = [
        ShapedScan { noise_px: 0.0, is_sampled: false, ..ShapedScan::FINE },
        ShapedScan { is_sampled: false, ..ShapedScan::FINE },
    ];
    // Without noise what is left is the fit; with it, a mean of four.
    for (scan, tolerance_mm) in scans.into_iter().zip([0.002, 0.004]) {
        let errors: Vec<[Vector3<f64>; 3]> = (0..FEW)
            .into_par_iter()
            .map(|seed| {
                let pose = part_from_datum(seed);
                let (cloud, calibration) = shaped_scan(&TestPart, &pose, seed, &scan);
                let result = evaluate(&test_plan(&pose, &[]), &cloud, Some(&calibration), &Models::new()).unwrap();
                // From the fitted to the true datum frame.
                let made_from_found = pose.inverse() * result.datum_from_part.unwrap().inverse();
                let centre = |id: &str| {
                    let feature = result.features.iter().find(|feature| feature.id == id).unwrap();
                    let at = match feature.geometry.unwrap() {
                        Geometry::Surface(Shape::Sphere { centre_mm, .. })
                        | Geometry::Circle { centre_mm, .. }
                        | Geometry::Slot { centre_mm, .. } => centre_mm,
                        other => panic!("{other:?}"),
                    };
                    made_from_found.rotation * at + made_from_found.translation_mm
                };
                [
                    centre("ball") - Vector3::from(BALL.0),
                    centre("hole") - Vector3::new(HOLE.0[0], HOLE.0[1], 8.0),
                    centre("slot") - Vector3::new(SLOT.0[0], SLOT.0[1], 6.0),
                ]
            })
            .collect();
        for (idx, name) in ["ball", "hole", "slot"].into_iter().enumerate() {
            let mean = errors.iter().map(|errors| errors[idx]).sum::<Vector3<f64>>() / FEW as f64;
            let spread =
                (errors.iter().map(|errors| (errors[idx] - mean).norm_squared()).sum::<f64>() / FEW as f64).sqrt();
            eprintln!(
                "{} px, {name}: mean {:+.4} {:+.4} {:+.4} mm, spread {spread:.4}",
                scan.noise_px, mean.x, mean.y, mean.z
            );
            assert!(mean.norm() < tolerance_mm, "{name}: {mean}");
        }
    }
}
