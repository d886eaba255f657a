//! Plan documents: refused plans with the pointer to the error, and what is copied to results.

use std::path::PathBuf;

use remedy::Remedy as _;
use serde_json::{Value, json};

use super::plan::{TestPart, test_plan};
use super::shaped_scan::{ShapedScan, part_from_datum, shaped_scan};
use super::surfaces::gauge;
use super::synthetic::SIGMA_MM;
use crate::*;

fn schema_file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/schemas/plan.schema.json")
}

/// A plan of a block on a table.
fn block(characteristic: Value) -> Value {
    json!({
        "format": "sheaf-plan/1",
        "features": [
            { "id": "table", "shape": { "type": "plane" } },
            { "id": "top", "shape": { "type": "plane", "select": { "region": {
                "type": "box", "min_mm": [-7.0, -8.0, 380.0], "max_mm": [13.0, 4.0, 395.0] } } } },
        ],
        "characteristics": [characteristic],
    })
}

fn height(rest: &Value) -> Value {
    let mut characteristic =
        json!({ "id": "height", "measure": { "type": "step", "base": "table", "top": "top" } });
    characteristic.as_object_mut().unwrap().extend(rest.as_object().unwrap().clone());
    characteristic
}

fn read(plan: &Value) -> Result<Plan, PlanDocumentError> {
    Plan::from_json(&plan.to_string())
}

#[test]
fn a_plan_is_the_same_after_writing_and_reading() {
    let plan = test_plan(&part_from_datum(1), &[(json!({ "type": "radius", "of": "ball" }), 6.0)]);
    assert_eq!(read(&serde_json::to_value(&plan).unwrap()).unwrap(), plan);
}

#[test]
fn the_plan_of_the_how_to_page_is_valid() {
    let page = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/how-to/judge-a-part-by-a-plan.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, rest) = page.split_once("```json\n").unwrap();
    let plan = Plan::from_json(rest.split_once("```").unwrap().0).unwrap();
    assert_eq!((plan.features.len(), plan.characteristics.len()), (5, 4));
}

#[test]
fn the_published_schema_matches_the_program() {
    let published: Value = serde_json::from_str(&std::fs::read_to_string(schema_file()).unwrap()).unwrap();
    assert!(
        published == Plan::schema(),
        "regenerate it: cargo test -p sheaf-metrology --lib writes_the_schema -- --ignored"
    );
}

#[test]
#[ignore = "writes server/docs/schemas/plan.schema.json"]
fn writes_the_schema() {
    std::fs::write(schema_file(), format!("{:#}\n", Plan::schema())).unwrap();
}

#[test]
fn an_inconsistent_plan_is_refused_with_a_pointer() {
    let nominal = |rest: Value| block(height(&rest));
    let mut twice = nominal(json!({}));
    twice["features"][1]["id"] = json!("table");
    let mut unknown = nominal(json!({}));
    unknown["features"][1]["shape"] = json!({ "type": "circle", "plane": "lid" });
    let frameless =
        block(json!({ "id": "x", "measure": { "type": "distance", "from": "table", "to": "top", "along": "x" } }));
    for (plan, pointer) in [
        (nominal(json!({ "nominal_deg": 8.9 })), "/characteristics/0/nominal_deg"),
        (nominal(json!({ "upper": 0.1 })), "/characteristics/0"),
        (nominal(json!({ "nominal_mm": 8.9, "lower": 0.1, "upper": -0.1 })), "/characteristics/0/lower"),
        (
            block(json!({ "id": "f", "measure": { "type": "flatness", "of": "top" }, "lower": -0.1 })),
            "/characteristics/0",
        ),
        (
            block(json!({ "id": "d", "measure": { "type": "diameter", "of": "top" } })),
            "/characteristics/0/measure/of",
        ),
        (
            block(json!({ "id": "d", "measure": { "type": "flatness", "of": "lid" } })),
            "/characteristics/0/measure",
        ),
        (frameless, "/characteristics/0/measure"),
        (twice, "/features/1/id"),
        (unknown, "/features/1/shape"),
    ] {
        let error = read(&plan).unwrap_err();
        let PlanDocumentError::Plan(wrong) = &error else { panic!("{plan}: {error:?}") };
        assert_eq!(wrong.pointer, pointer, "{wrong}");
        assert!(error.remedy().is_some());
    }
    let mut misspelt = nominal(json!({}));
    misspelt["features"][1]["shape"]["select"]["regoin"] = json!(1);
    for plan in [misspelt, nominal(json!({ "tolerance": 0.1 })), json!({ "format": "sheaf-plan/2" })] {
        assert!(matches!(read(&plan), Err(PlanDocumentError::Json { .. })), "{plan}");
    }
}

#[test]
fn without_a_calibration_nothing_is_decided_and_missing_contributions_are_named() {
    let plan = read(&block(height(&json!({
        "nominal_mm": 8.9, "lower": -0.5, "upper": 1.0, "attributes": { "k2002": "height", "n": 7 } }))))
    .unwrap();
    let result = evaluate(&plan, &gauge(8.9, SIGMA_MM, 1), None, &Models::new()).unwrap();
    let height = &result.characteristics[0];
    assert_eq!((height.verdict, result.verdict), (Some(PartVerdict::Undecided), PartVerdict::Undecided));
    assert!(height.missing.contains(&Missing::Calibration), "{:?}", height.missing);
    assert_eq!(height.attributes["k2002"], json!("height"));
    assert!((height.value.unwrap() - 8.9).abs() < height.expanded_uncertainty.unwrap());
}

#[test]
fn one_sided_limits_judge_one_side_and_a_missing_feature_is_invalid() {
    let pose = part_from_datum(5);
    let (cloud, calibration) = shaped_scan(&TestPart, &pose, 5, &ShapedScan::FINE);
    let plan = |limits: Value, id: &str| {
        let mut plan = serde_json::to_value(test_plan(&pose, &[])).unwrap();
        let features = plan["features"].as_array_mut().unwrap();
        features.push(json!({ "id": "cup", "shape": { "type": "circle", "plane": "table", "select": {
            "region": { "type": "sphere", "centre_mm": [0.0, -25.0, 0.0], "radius_mm": 2.0 } } } }));
        let mut characteristic = json!({ "id": "d", "measure": { "type": "diameter", "of": id } });
        characteristic.as_object_mut().unwrap().extend(limits.as_object().unwrap().clone());
        plan["characteristics"] = json!([characteristic]);
        read(&plan).unwrap()
    };
    for (limits, id, verdict) in [
        (json!({ "nominal_mm": 9.0, "upper": 0.5 }), "hole", PartVerdict::NotOk),
        (json!({ "nominal_mm": 9.0, "lower": -0.5 }), "hole", PartVerdict::Ok),
        (json!({ "nominal_mm": 10.0, "lower": -0.5, "upper": 0.5 }), "hole", PartVerdict::Ok),
        (json!({ "nominal_mm": 10.0, "lower": -0.0001, "upper": 0.0001 }), "hole", PartVerdict::Undecided),
        (json!({ "nominal_mm": 10.0, "lower": -0.5, "upper": 0.5 }), "cup", PartVerdict::Invalid),
        // Without limits the part must not be accepted.
        (json!({}), "hole", PartVerdict::Invalid),
    ] {
        let result = evaluate(&plan(limits.clone(), id), &cloud, Some(&calibration), &Models::new()).unwrap();
        assert_eq!(result.verdict, verdict, "{limits} {id}: {:?}", result.characteristics[0]);
        assert_eq!(result.characteristics[0].failure.is_some(), id == "cup");
    }
}

#[test]
fn points_are_selected_by_order_and_by_surface_direction() {
    let pose = part_from_datum(2);
    let (cloud, calibration) = shaped_scan(&super::seams::Seam, &pose, 2, &ShapedScan::FINE);
    let facing =
        |normal: [f64; 3], within_deg: f64| json!({ "facing": { "normal": normal, "within_deg": within_deg } });
    let points = |select: Value| {
        let plan = json!({ "format": "sheaf-plan/1", "characteristics": [],
            "features": [{ "id": "any", "shape": { "type": "plane", "select": select } }] });
        let result = evaluate(&read(&plan).unwrap(), &cloud, Some(&calibration), &Models::new()).unwrap();
        result.features[0].cloud_indices.iter().map(|idx| cloud.points[*idx as usize]).collect::<Vec<_>>()
    };
    let of_one = points(json!({ "orders": [1] }));
    assert!(!of_one.is_empty() && of_one.iter().all(|point| point.order == 1));
    let flat = points(facing([0.0, 0.0, -1.0], 8.0));
    let all = points(json!({}));
    assert!(flat.len() > all.len() / 2, "{} of {}", flat.len(), all.len());
    // Only rolled edges face sideways, and they are not a plane.
    assert!(points(facing([1.0, 0.0, 0.0], 10.0)).len() < all.len() / 20);
}
