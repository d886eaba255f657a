//! A plan tried on the scan of an inspected part: the same answer as the inspection, and nothing is stored.

use serde_json::{Value, json};

use crate::common::server::Server;

/// What an inspection and a trial have in common.
const COMMON: [&str; 6] = ["verdict", "results", "frame", "datum_from_part", "features", "calibration_id"];

/// Tries the plans of inspections on their scans; `recipe` is that of the inspections.
pub fn same_as_inspected(server: &Server, inspections: [&Value; 2], recipe: &Value) {
    let before = stored(server);
    for inspection in inspections {
        let scan_id = inspection["scan_id"].as_str().unwrap();
        let said = evaluate(server, scan_id, &recipe["plan"]);
        for part in COMMON {
            assert_eq!(said[part], inspection[part], "{part}");
        }
        assert_eq!(said["scan_id"], inspection["scan_id"]);
    }
    let scan_id = inspections[0]["scan_id"].as_str().unwrap();
    features_and_failures(server, scan_id, &recipe["plan"]);
    refusals(server, scan_id, &recipe["plan"]);
    assert_eq!(stored(server), before, "nothing is stored");
}

fn evaluate(server: &Server, scan_id: &str, plan: &Value) -> Value {
    server.post(&format!("/api/v1/scans/{scan_id}/evaluate"), &json!({ "plan": plan })).expect(200)
}

/// The newest record of each kind that a trial could leave behind.
fn stored(server: &Server) -> Vec<Value> {
    let newest = |list: &str| server.get(&format!("/api/v1/{list}?limit=1")).expect(200)["items"].clone();
    ["inspections", "measurements", "scans", "jobs", "recipes"].into_iter().map(newest).collect()
}

/// A characteristic whose features are not found says so; the others have their values.
fn features_and_failures(server: &Server, scan_id: &str, plan: &Value) {
    let found = server.post(
        &format!("/api/v1/scans/{scan_id}/find-features"),
        &json!({ "tool": "step", "region_mm": [-8, -20, 380, 8, 20, 410] }),
    );
    let found = found.expect(200);
    let [base, top] = &found["features"].as_array().unwrap()[..] else { panic!("{found}") };
    assert_eq!((&base["role"], &top["role"]), (&json!("base"), &json!("top")), "{found}");
    assert!(top["region"]["cells"].as_array().is_some_and(|cells| !cells.is_empty()), "{found}");

    let mut plan = plan.clone();
    let nowhere = json!({ "region": { "type": "box", "min_mm": [90, 90, 90], "max_mm": [91, 91, 91] } });
    let features = plan["features"].as_array_mut().unwrap();
    features.push(json!({ "id": "ball", "shape": { "type": "sphere", "select": nowhere } }));
    let characteristics = plan["characteristics"].as_array_mut().unwrap();
    characteristics.push(json!({ "id": "size", "measure": { "type": "diameter", "of": "ball" },
        "nominal_mm": 5, "upper": 0.1 }));
    let said = evaluate(server, scan_id, &plan);
    let results = said["results"].as_array().unwrap();
    assert_eq!((&said["verdict"], &results[0]["verdict"]), (&json!("invalid"), &json!("ok")), "{said:#}");
    assert_eq!((&results[1]["id"], &results[1]["verdict"]), (&json!("size"), &json!("invalid")));
    assert!(results[1]["failure"].as_str().unwrap().contains("ball"), "{said:#}");
    // Without characteristics the features alone, and no verdict.
    plan["characteristics"] = json!([]);
    let said = evaluate(server, scan_id, &plan);
    assert_eq!((&said["verdict"], said["features"].as_array().unwrap().len()), (&json!("invalid"), 3));
}

fn refusals(server: &Server, scan_id: &str, plan: &Value) {
    let url = format!("/api/v1/scans/{scan_id}/evaluate");
    let refused = |change: &dyn Fn(&mut Value), place: &str, words: &str| {
        let mut plan = plan.clone();
        change(&mut plan);
        let problem = server.post(&url, &json!({ "plan": plan })).expect(422);
        assert_eq!(problem["pointer"], place, "{problem:#}");
        assert!(problem["detail"].as_str().unwrap().contains(words), "{problem:#}");
        assert!(problem["remedy"].is_string(), "{problem:#}");
    };
    let measure = "/plan/characteristics/0/measure";
    refused(
        &|plan| plan["characteristics"][0]["measure"]["top"] = json!("lid"),
        measure,
        "characteristic \"height\"",
    );
    refused(
        &|plan| plan["characteristics"][0]["upper"] = json!(-1),
        "/plan/characteristics/0/lower",
        "characteristic \"height\": the lower limit",
    );
    let empty = json!({ "type": "box", "min_mm": [0, 0, 0], "max_mm": [0, 1, 1] });
    refused(
        &|plan| plan["features"][1]["shape"]["select"]["region"] = empty.clone(),
        "/plan/features/1/shape/select",
        "feature \"top\"",
    );
    refused(
        &|plan| plan["characteristics"][0]["attributes"] = json!({ "K2001": [] }),
        "/plan/characteristics/0/attributes/K2001",
        "\"height\"",
    );
    refused(
        &|plan| plan["characteristics"][0]["measure"]["type"] = json!("weight"),
        &format!("{measure}/type"),
        "weight",
    );
    refused(&|plan| plan["alignment"] = json!({ "primary": "table" }), "/plan/alignment", "missing field");
    assert_eq!(server.post(&url, &json!({})).expect(422)["pointer"], "/");
    server.post(&url, &json!({ "plan": plan, "store": true })).expect(422);
    server.post("/api/v1/scans/none/evaluate", &json!({ "plan": plan })).expect(404);

    let find = |body: Value, status: u16| {
        server.post(&format!("/api/v1/scans/{scan_id}/find-features"), &body).expect(status)
    };
    assert_eq!(find(json!({ "tool": "ruler" }), 422)["pointer"], "/tool");
    let nowhere = find(json!({ "tool": "sphere", "region_mm": [90, 90, 90, 91, 91, 91] }), 422);
    assert!(nowhere["detail"].is_string() && nowhere["remedy"].is_string(), "{nowhere:#}");
}
