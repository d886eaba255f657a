//! `sheaf measure --plan`, `sheaf inspect` and `sheaf compare` on rendered scans: values, exit codes, refusals.
//! Accuracy on simulated stations is tested in `metrology`.

use std::path::Path;

use serde_json::{Value, json};

use crate::commands::contract::scan;
use crate::commands::schemas::follows;
use crate::common::{err, out, path, sheaf, sheaf_json, sheaf_ok, small_calibration, small_capture};

/// A plan for the gauge block on its table, with a region around the position found by the tool.
fn gauge_plan(cloud: &str, rest: &Value) -> Value {
    let (step, _) = sheaf_json(&["measure", cloud, "--tool", "step", "--nominal-mm", "8.9"]);
    let top = &step["features"][1]["shape"]["point_mm"];
    let corner = |by: f64| [0, 1, 2].map(|k| top[k].as_f64().unwrap() + if k == 2 { by / 4.0 } else { by });
    let mut height = json!({ "id": "height", "measure": { "type": "step", "base": "table", "top": "top" },
        "attributes": { "K2001": "1" } });
    height.as_object_mut().unwrap().extend(rest.as_object().unwrap().clone());
    json!({
        "format": "sheaf-plan/1",
        "name": "gauge",
        "features": [
            { "id": "table", "shape": { "type": "plane" } },
            { "id": "top", "shape": { "type": "plane", "select": { "region": {
                "type": "box", "min_mm": corner(-9.0), "max_mm": corner(9.0) } } } },
        ],
        "characteristics": [height],
    })
}

#[test]
fn a_plan_gives_the_value_of_the_tool_and_the_exit_code_of_the_part() {
    let (folder, cloud) = scan("gauge");
    let file = path(folder.path(), "plan.json");
    for (rest, exit, verdict) in [
        (json!({}), 0, "invalid"),
        (json!({ "nominal_mm": 8.9, "lower": -1.0, "upper": 1.0 }), 0, "ok"),
        (json!({ "nominal_mm": 8.0, "upper": 0.3 }), 5, "not_ok"),
        (json!({ "nominal_mm": 8.9, "lower": -0.001, "upper": 0.001 }), 6, "undecided"),
    ] {
        std::fs::write(&file, gauge_plan(&cloud, &rest).to_string()).unwrap();
        follows("plan", Path::new(&file));
        let (result, code) = sheaf_json(&["measure", &cloud, "--plan", &file]);
        assert_eq!((code, result["verdict"].as_str()), (exit, Some(verdict)), "{result:#}");
        let height = &result["characteristics"][0];
        let (value, u) = (height["value"].as_f64().unwrap(), height["expanded_uncertainty"].as_f64().unwrap());
        assert!((value - 8.9).abs() <= u, "{value} ± {u}");
        assert_eq!(height["attributes"]["K2001"], "1");
        let text = out(&sheaf(&["measure", &cloud, "--plan", &file]));
        assert!(text.contains("height") && text.contains("(ISO 14253-1)"), "{text}");
    }
}

#[test]
fn an_inconsistent_plan_is_refused_with_its_entry() {
    let (folder, cloud) = scan("gauge");
    let file = path(folder.path(), "plan.json");
    std::fs::write(&file, gauge_plan(&cloud, &json!({ "nominal_deg": 8.9 })).to_string()).unwrap();
    let (result, code) = sheaf_json(&["measure", &cloud, "--plan", &file]);
    assert_eq!(
        (code, result["problem"]["entry"].as_str()),
        (3, Some("/characteristics/0/nominal_deg")),
        "{result:#}"
    );
    let both = sheaf(&["measure", &cloud, "--plan", &file, "--tool", "step"]);
    assert_eq!(both.status.code(), Some(2), "{}", err(&both));
}

#[test]
fn a_recipe_gives_the_same_verdict_as_its_plan() {
    let (folder, cloud) = scan("gauge");
    let file = path(folder.path(), "gauge.recipe.json");
    let recipe = |limits: &Value| {
        json!({
            "format": "sheaf-recipe/1", "id": "gauge", "version": 7,
            "recipe": { "name": "gauge", "scan": { "from_mm": -1, "to_mm": 1, "step_mm": 1 },
                "plan": gauge_plan(&cloud, limits) },
        })
    };
    let limits = json!({ "nominal_mm": 8.9, "lower": -1.0, "upper": 1.0 });
    for (limits, exit, verdict) in [
        (json!({}), 5, "invalid"),
        (limits.clone(), 0, "ok"),
        (json!({ "nominal_mm": 8.9, "lower": -0.001, "upper": 0.001 }), 6, "undecided"),
    ] {
        std::fs::write(&file, recipe(&limits).to_string()).unwrap();
        let (result, code) = sheaf_json(&["inspect", &cloud, "--recipe", &file, "--serial", "S1"]);
        assert_eq!(
            (code, &result["verdict"], &result["serial"]),
            (exit, &json!(verdict), &json!("S1")),
            "{result:#}"
        );
        assert_eq!((&result["recipe"]["id"], &result["recipe"]["version"]), (&json!("gauge"), &json!(7)));
        assert_eq!(result["characteristics"][0]["reason"].is_string(), verdict == "undecided", "{result:#}");
        let text = out(&sheaf(&["inspect", &cloud, "--recipe", &file]));
        assert!(text.starts_with("recipe gauge@7\n") && text.contains("(ISO 14253-1)"), "{text}");
    }
    let mut wrong = recipe(&limits);
    wrong["recipe"]["scan"]["step_mm"] = json!(-1);
    std::fs::write(&file, wrong.to_string()).unwrap();
    let (result, code) = sheaf_json(&["inspect", &cloud, "--recipe", &file]);
    let entry = result["problem"]["entry"].as_str();
    assert_eq!((code, entry), (3, Some("/recipe/scan/step_mm")), "{result:#}");
}

/// The comparison that a plan with a surface profile of the model `m.stl` beside it gives, with the entries that
/// `sheaf compare` adds.
fn profile_by_plan(folder: &Path, cloud: &str, sha256: &str, compared: &Value) -> Value {
    let file = path(folder, "plan.json");
    let plan = |sha256: &str| {
        json!({ "format": "sheaf-plan/1", "features": [], "characteristics": [{ "id": "shell", "upper": 10.0,
            "measure": { "type": "surface_profile", "model": { "name": "m.stl", "sha256": sha256 }, "best_fit": true } }] })
    };
    std::fs::write(&file, plan(&"0".repeat(64)).to_string()).unwrap();
    let (refused, code) = sheaf_json(&["measure", cloud, "--plan", &file]);
    assert_eq!(code, 3, "{refused:#}");
    assert!(refused.to_string().contains("SHA-256"), "{refused:#}");
    std::fs::write(&file, plan(sha256).to_string()).unwrap();
    follows("plan", Path::new(&file));
    let (result, _) = sheaf_json(&["measure", cloud, "--plan", &file]);
    let mut comparison = result["characteristics"][0]["comparison"].clone();
    for name in ["cloud", "part", "map", "report_file", "calibration_id"] {
        comparison[name] = compared[name].clone();
    }
    comparison
}

#[test]
fn a_cloud_has_no_deviations_from_its_own_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let (capture, calibration) = (small_capture(), small_calibration());
    let (cloud, mesh, map) =
        (path(folder.path(), "c.ply"), path(folder.path(), "m.stl"), path(folder.path(), "map.csv"));
    let (capture, calibration) = (capture.to_str().unwrap(), calibration.to_str().unwrap());
    sheaf_ok(&["scan", capture, "-c", calibration, "--scan", "sphere", "-o", &cloud, "--mesh", &mesh, "-q"]);
    let report = path(folder.path(), "report.html");
    let files = ["--map", &map, "--report", &report];
    let asked = [&["compare", &cloud, &mesh, "--best-fit", "--tolerance-mm", "5"], &files[..]].concat();
    let (result, code) = sheaf_json(&asked);
    assert!(result["mean_mm"].as_f64().unwrap().abs() < 0.02, "{result:#}");
    assert!(result["covered_mm2"].as_f64() > Some(0.5 * result["area_mm2"].as_f64().unwrap()), "{result:#}");
    let expected = match result["verdict"].as_str() {
        Some("ok") => 0,
        Some("undecided") => 6,
        other => panic!("{other:?}"),
    };
    assert_eq!(code, expected);
    let rows = std::fs::read_to_string(Path::new(&map)).unwrap();
    assert_eq!(rows.lines().count() - 1, result["n_points"].as_u64().unwrap() as usize);
    assert!(out(&sheaf(&asked)).contains("covered"));
    let page = std::fs::read_to_string(Path::new(&report)).unwrap();
    for text in ["Comparison with m.stl", "<h2>Deviations</h2>", "<h2>Worst places</h2>", "no deviation"] {
        assert!(page.contains(text), "{text}");
    }
    let sha256 = app::hash_hex(&std::fs::read(&mesh).unwrap());
    assert_eq!(profile_by_plan(folder.path(), &cloud, &sha256, &result), result);
    let alone = sheaf(&["compare", &cloud, &mesh]);
    assert_eq!(alone.status.code(), Some(2), "{}", err(&alone));
}
