//! Surface profiles in plans: a dent's depth, the part of the surface that is toleranced, what a plan may say.

use rayon::prelude::*;
use serde_json::{Value, json};

use super::{DENT, Freeform, dent_depth_mm, faces, near, nominal_mesh, request};
use crate::tests::plan::{FEW, MANY, TestPart, test_plan};
use crate::tests::shaped_scan::{ShapedScan, part_from_datum, shaped_scan};
use crate::*;

/// The hash by which the plan names the model; what it is the hash of does not matter here.
const SHA256: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

fn plan_of(measure: Value, upper: f64) -> Value {
    json!({ "format": "sheaf-plan/1", "features": [],
        "characteristics": [{ "id": "shell", "measure": measure, "upper": upper }] })
}

fn measure(rest: Value) -> Value {
    let mut measure = json!({ "type": "surface_profile", "model": { "name": "freeform.stl", "sha256": SHA256 }, "best_fit": true });
    for (key, value) in rest.as_object().unwrap() {
        measure[key] = value.clone();
    }
    measure
}

fn read(document: &Value) -> Result<Plan, PlanDocumentError> {
    Plan::from_json(&document.to_string())
}

/// Pose of the model in the scan as x, y, z (mm) and rotations about x, y, z (degrees).
fn start(seed: u64) -> [f64; 6] {
    let pose = near(&part_from_datum(seed), seed).inverse();
    let (rx, ry, rz) = pose.rotation.euler_angles();
    let [x, y, z]: [f64; 3] = pose.translation_mm.into();
    [x, y, z, rx.to_degrees(), ry.to_degrees(), rz.to_degrees()]
}

/// What is said about a part with a dent; `region`: the toleranced part of the surface.
fn profile_of(dent_mm: f64, seed: u64, models: &Models, region: Option<Value>) -> CharacteristicResult {
    let (cloud, calibration) = shaped_scan(&Freeform { dent_mm }, &part_from_datum(seed), seed, &ShapedScan::FINE);
    let mut rest = json!({ "start": start(seed) });
    if let Some(region) = region {
        rest["region"] = region;
    }
    let plan = read(&plan_of(measure(rest), 0.2)).unwrap();
    let result = evaluate(&plan, &cloud, Some(&calibration), models).unwrap();
    assert_eq!(result.verdict, result.characteristics[0].verdict.unwrap(), "the part is its only characteristic");
    result.characteristics.into_iter().next().unwrap()
}

fn models() -> Models {
    Models::from([(SHA256.to_owned(), Nominal::new(&nominal_mesh(200)).unwrap())])
}

#[test]
fn the_profile_of_a_surface_is_twice_the_depth_of_its_dent_and_is_judged_where_it_is_toleranced() {
    check(FEW);
}

#[test]
#[ignore = "a minute: cargo xtask campaign"]
fn campaign_of_surface_profiles() {
    check(MANY);
}

fn check(seeds: u64) {
    let models = models();
    let rows: Vec<[(f64, f64); 2]> = (0..seeds)
        .into_par_iter()
        .map(|seed| {
            let half = json!({ "type": "box", "min_mm": [-24.0, -24.0, 0.0], "max_mm": [0.0, 24.0, 20.0] });
            let dented = profile_of(0.2, seed, &models, None);
            assert_eq!((dented.verdict, dented.missing.len()), (Some(PartVerdict::NotOk), 0), "seed {seed}");
            let comparison = dented.comparison.as_deref().unwrap();
            assert_eq!(dented.value, comparison.largest.map(|largest| 2.0 * largest.deviation_mm));
            // The zone is twice the permitted deviation wide.
            assert_eq!((comparison.tolerance_mm, comparison.verdict), (Some(0.1), dented.verdict));
            // Away from the dent: what is left is noise and the calibration.
            let sound = profile_of(0.2, seed, &models, Some(half));
            assert_ne!(sound.verdict, Some(PartVerdict::NotOk), "seed {seed}");
            let sound_mm = (sound.value.unwrap(), sound.expanded_uncertainty.unwrap());
            let area_mm2 = sound.comparison.unwrap().statistics.area_mm2;
            assert!((0.45..0.55).contains(&(area_mm2 / comparison.statistics.area_mm2)), "{area_mm2}");
            let error = dented.value.unwrap() - 2.0 * dent_depth_mm(0.2, DENT.0);
            [(error, dented.expanded_uncertainty.unwrap()), sound_mm]
        })
        .collect();
    for (which, what) in ["a dent of 0.2 mm", "no dent"].into_iter().enumerate() {
        let of = || rows.iter().map(move |row| row[which]);
        let n_inside = of().filter(|(error, u)| error.abs() <= *u).count();
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / seeds as f64;
        let (error, u) = (mean(&mut of().map(|(error, _)| error)), mean(&mut of().map(|(_, u)| u)));
        eprintln!("{what}: {n_inside} of {seeds} inside U; mean error {error:+.4} mm, mean U {u:.4} mm");
        // At 95 %, fewer than 3 of 4 have a probability of 1.4 %, fewer than 17 of 20 one of 1.6 %.
        assert!(n_inside >= (if seeds == FEW { 3 } else { 17 }), "{what}: {n_inside}");
    }
}

#[test]
fn half_of_what_noise_adds_to_the_largest_of_many_cells_is_subtracted() {
    const BELOW_MM: f64 = 0.2;
    // A face of the part, drawn too high: all of it deviates equally.
    let nominal = Nominal::new(&faces(&[([-23.5, 0.5], [-17.5, 23.5], 8.0 + BELOW_MM)])).unwrap();
    let errors: Vec<(f64, f64)> = (0..FEW)
        .into_par_iter()
        .map(|seed| {
            let pose = part_from_datum(seed);
            let exact = ShapedScan { is_sampled: false, ..ShapedScan::FINE };
            let (cloud, calibration) = shaped_scan(&TestPart, &pose, seed, &exact);
            let align = AlignTo::Datums(Box::new(test_plan(&pose, &[])));
            let request = CompareRequest { reach_mm: Some(0.5), ..request(align, 0.1) };
            let largest = compare(&cloud, Some(&calibration), &nominal, &request).unwrap().largest.unwrap();
            (largest.deviation_mm - BELOW_MM, largest.noise_mm)
        })
        .collect();
    let mean = |of: fn(&(f64, f64)) -> f64| errors.iter().map(of).sum::<f64>() / errors.len() as f64;
    let (error_mm, noise_mm) = (mean(|one| one.0), mean(|one| one.1));
    eprintln!("mean error {error_mm:+.4} mm; {noise_mm:.4} mm were subtracted");
    // The filter leaves noise that neighbouring cells share; what is subtracted is therefore too small, never too large.
    assert!((0.0..0.55 * (error_mm + noise_mm)).contains(&error_mm), "{error_mm} {noise_mm}");
}

#[test]
fn a_model_that_is_missing_makes_the_characteristic_invalid_and_names_it() {
    let result = profile_of(0.0, 1, &Models::new(), None);
    assert_eq!((result.verdict, result.value), (Some(PartVerdict::Invalid), None));
    assert_eq!(result.reason().unwrap(), "not measured: the model freeform.stl is missing");
}

#[test]
fn a_part_beside_its_model_is_invalid() {
    let (cloud, calibration) = shaped_scan(&Freeform { dent_mm: 0.0 }, &part_from_datum(1), 1, &ShapedScan::FINE);
    let plan = read(&plan_of(measure(json!({ "start": [0.0, 0.0, -900.0, 0.0, 0.0, 0.0] })), 0.2)).unwrap();
    let result = evaluate(&plan, &cloud, Some(&calibration), &models()).unwrap();
    assert_eq!(result.verdict, PartVerdict::Invalid);
    assert!(result.characteristics[0].reason().unwrap().contains("points lie within"));
}

#[test]
fn contradictory_surface_profiles_are_refused_with_their_place() {
    let cases = [
        (json!({ "best_fit": false }), "/characteristics/0/measure", "no datum frame"),
        (json!({ "model": { "name": "a.stl", "sha256": "12" } }), "/characteristics/0/measure/model", "64"),
        (
            json!({ "model": { "name": "../a.stl", "sha256": SHA256 } }),
            "/characteristics/0/measure/model",
            "folder",
        ),
        (json!({ "reach_mm": 0.0 }), "/characteristics/0/measure/reach_mm", "distance"),
        (
            json!({ "region": { "type": "sphere", "centre_mm": [0.0, 0.0, 0.0], "radius_mm": 0.0 } }),
            "/characteristics/0/measure/region",
            "radius",
        ),
    ];
    for (rest, pointer, word) in cases {
        let Err(PlanDocumentError::Plan(error)) = read(&plan_of(measure(rest.clone()), 0.2)) else {
            panic!("{rest} is accepted")
        };
        assert_eq!(error.pointer, pointer, "{error}");
        assert!(error.detail.contains(word), "{error}");
    }
    // A start pose contradicts datums.
    let mut aligned = plan_of(measure(json!({ "start": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0] })), 0.2);
    aligned["features"] = json!([
        { "id": "a", "shape": { "type": "plane" } }, { "id": "b", "shape": { "type": "plane" } },
        { "id": "c", "shape": { "type": "plane" } }
    ]);
    aligned["alignment"] = json!({ "primary": "a", "secondary": "b", "tertiary": "c" });
    let Err(PlanDocumentError::Plan(error)) = read(&aligned) else { panic!("it is accepted") };
    assert_eq!(error.pointer, "/characteristics/0/measure/start");
    assert!(read(&plan_of(measure(json!({})), -0.2)).is_err(), "a zone has a width");
}
