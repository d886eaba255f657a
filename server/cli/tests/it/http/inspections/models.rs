//! CAD models: what is accepted and kept, a part compared with one in a trial and in an inspection, the map of deviations.

use serde_json::{Value, json};

use super::{STEP_MM, block_stl};
use crate::common::server::Server;

/// Height of the good block, mm, and by how much the drawing is higher.
const HEIGHT_MM: f64 = 8.9;
const HIGHER_MM: f64 = 0.3;

/// Compares inspected parts, of which the second is lower by `defect_mm`, with a drawing.
pub fn compared(server: &Server, good: &Value, bad: &Value, defect_mm: f64) {
    let stl = block_stl([[-8.0, 8.0], [0.0, 20.0], [0.0, HEIGHT_MM + HIGHER_MM]]);
    let model = uploaded(server, &stl);
    let plan = |upper_mm: f64| plan(&model, upper_mm);

    // In a trial: the tops lie below that of the drawing.
    let trial = |inspection: &Value, upper_mm: f64| {
        let scan_id = inspection["scan_id"].as_str().unwrap();
        let body = json!({ "plan": plan(upper_mm) });
        let said = server.post(&format!("/api/v1/scans/{scan_id}/evaluate"), &body).expect(200);
        said["results"][0].clone()
    };
    let number = |result: &Value, name: &str| result[name].as_f64().unwrap_or_else(|| panic!("{result:#}"));
    let low = trial(bad, 0.2);
    for (result, below_mm) in [(&trial(good, 1.0), HIGHER_MM), (&low, HIGHER_MM + defect_mm)] {
        let (value, u) = (number(result, "value"), number(result, "expanded_uncertainty"));
        println!("top {below_mm} mm below the drawing: surface profile {value:.4} mm, U {u:.4} mm");
        assert!((value - 2.0 * below_mm).abs() <= u, "{value} ± {u}");
        let comparison = &result["comparison"];
        assert!((number(comparison, "mean_mm") + below_mm).abs() <= 0.01, "{comparison:#}");
        assert!(number(comparison, "covered_mm2") > 0.9 * number(comparison, "area_mm2"), "{comparison:#}");
        assert!(!comparison["worst"].as_array().unwrap().is_empty());
        assert_eq!(result["verdict"], if *result == low { "not_ok" } else { "ok" }, "{result:#}");
    }
    map(server, bad, &plan(0.2), &low);
    inspected(server, bad, &plan(0.2), &model, &low);
    refused(server, bad, &plan(0.2));
}

/// The top of the block, without a strip along its rim, aligned by the table, a side and the middle of the top.
fn plan(model: &Value, upper_mm: f64) -> Value {
    json!({
        "format": "sheaf-plan/1",
        "features": [
            { "id": "table", "shape": { "type": "plane" } },
            { "id": "top", "shape": { "type": "plane", "select": { "region": {
                "type": "box", "min_mm": [-9.0, -7.0, 380.0], "max_mm": [9.0, 7.0, 396.0] } } } },
            { "id": "side", "shape": { "type": "edge", "plane": "top", "select": { "region": {
                "type": "box", "min_mm": [7.0, -6.0, 380.0], "max_mm": [13.0, 6.0, 396.0] } } } },
            { "id": "middle", "shape": { "type": "point", "of": { "centre": "top" } } },
        ],
        "alignment": { "primary": "table", "secondary": "side", "tertiary": "middle" },
        "characteristics": [{ "id": "shell", "upper": upper_mm, "measure": {
            "type": "surface_profile", "model": { "name": model["name"], "sha256": model["sha256"] },
            "region": { "type": "box", "min_mm": [-7.0, 1.0, 8.0], "max_mm": [7.0, 19.0, 10.0] } } }],
    })
}

/// Uploads a model, twice with one key, and reads it back.
fn uploaded(server: &Server, stl: &[u8]) -> Value {
    let send = |query: &str, key: &str, bytes: &[u8]| {
        let headers = [("content-type", "application/octet-stream"), ("idempotency-key", key)];
        server.send("POST", &format!("/api/v1/models?name={query}"), &headers, bytes)
    };
    let model = send("block.stl", "model-1", stl).expect(201);
    assert_eq!(send("block.stl", "model-1", stl).expect(201), model);
    let summary = &model["summary"];
    assert_eq!((&summary["n_triangles"], &summary["closed"]), (&json!(12), &json!(true)), "{model:#}");
    let size = |axis: usize| summary["max_mm"][axis].as_f64().unwrap() - summary["min_mm"][axis].as_f64().unwrap();
    assert!((size(2) - HEIGHT_MM - HIGHER_MM).abs() < 1e-5, "{model:#}");
    assert_eq!(server.get("/api/v1/models").expect(200)["items"], json!([model]));
    assert_eq!(server.get(model["file"].as_str().unwrap()).body, stl);

    let no_ending = send("block.step", "model-2", stl).expect(422);
    assert_eq!(no_ending["pointer"], "query/name", "{no_ending:#}");
    let garbage = send("block.stl", "model-3", b"solid nothing").expect(422);
    assert!(garbage["remedy"].is_string(), "{garbage:#}");
    assert_eq!(server.get("/api/v1/models").expect(200)["items"].as_array().unwrap().len(), 1);
    model
}

/// The deviations of the points agree with the value.
fn map(server: &Server, inspection: &Value, plan: &Value, result: &Value) {
    let scan_id = inspection["scan_id"].as_str().unwrap();
    let url = format!("/api/v1/scans/{scan_id}/deviations");
    let answer = server.post(&url, &json!({ "plan": plan, "characteristic": "shell", "limit": 20_000 }));
    assert_eq!(answer.status, 200, "{}", String::from_utf8_lossy(&answer.body));
    let floats: Vec<f32> =
        answer.body.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect();
    let rows: Vec<&[f32]> = floats.chunks_exact(5).collect();
    assert!((10_000..=20_000).contains(&rows.len()) && answer.body.len() == 20 * rows.len(), "{}", rows.len());
    let compared: Vec<f64> = rows.iter().filter(|row| row[3].is_finite()).map(|row| f64::from(row[3])).collect();
    let mean_mm = compared.iter().sum::<f64>() / compared.len() as f64;
    let expected_mm = result["comparison"]["mean_mm"].as_f64().unwrap();
    assert!(compared.len() > 200 && (mean_mm - expected_mm).abs() < 0.01, "{mean_mm} {expected_mm}");
    assert!(rows.iter().all(|row| row[3].is_finite() == row[4].is_finite()));

    let refused = |body: Value| server.post(&url, &body).expect(422)["pointer"].clone();
    assert_eq!(refused(json!({ "plan": plan, "characteristic": "height" })), "/characteristic");
    assert_eq!(refused(json!({ "plan": plan, "characteristic": "shell", "limit": 0 })), "/limit");
}

/// A recipe keeps the file of a model that is deleted; its inspection says what the trial said.
fn inspected(server: &Server, bad: &Value, plan: &Value, model: &Value, said: &Value) {
    let recipe =
        json!({ "name": "shell", "scan": { "from_mm": -12.0, "to_mm": 12.0, "step_mm": STEP_MM }, "plan": plan });
    server.post("/api/v1/recipes", &json!({ "id": "shell", "reason": "first", "recipe": recipe })).expect(201);
    let href = format!("/api/v1/models/{}", model["id"].as_str().unwrap());
    assert_eq!(server.send("DELETE", &href, &[], &[]).status, 204);
    server.get(&href).expect(404);
    let again = format!("/api/v1/inspections/{}/re-evaluate", bad["id"].as_str().unwrap());
    let accepted = server.post(&again, &json!({ "recipe": "shell" }));
    accepted.expect(202);
    let job = server.wait_for_job(accepted.header("location").unwrap());
    let inspection = server.get(job["result"]["href"].as_str().unwrap_or_else(|| panic!("{job:#}"))).expect(200);
    assert_eq!(&inspection["results"][0], said);
    let report = server.get(&format!("{}/report", job["result"]["href"].as_str().unwrap()));
    let page = String::from_utf8(report.body).unwrap();
    assert!(page.contains("block.stl") && page.contains("Worst places"), "{page}");
}

/// A plan with a model that is not stored is neither tried nor published.
fn refused(server: &Server, bad: &Value, plan: &Value) {
    let mut plan = plan.clone();
    plan["characteristics"][0]["measure"]["model"]["sha256"] = json!("0".repeat(64));
    let url = format!("/api/v1/scans/{}/evaluate", bad["scan_id"].as_str().unwrap());
    let tried = server.post(&url, &json!({ "plan": plan })).expect(422);
    assert_eq!(tried["pointer"], "/plan/characteristics/0/measure/model", "{tried:#}");
    assert!(tried["remedy"].as_str().unwrap().contains("/api/v1/models"), "{tried:#}");
    let recipe =
        json!({ "name": "lost", "scan": { "from_mm": 0.0, "to_mm": 1.0, "step_mm": STEP_MM }, "plan": plan });
    let body = json!({ "id": "lost", "reason": "first", "recipe": recipe });
    let published = server.post("/api/v1/recipes", &body).expect(422);
    assert_eq!(published["pointer"], "/recipe/plan/characteristics/0/measure/model", "{published:#}");
}
