//! The verdict on a part in all lists, the measurement plan, activation after a failed verification.

use serde_json::{Value, json};

use super::fresh;
use crate::common::server::Server;
use crate::common::small_capture;

/// Uploads and calibrates a capture; returns the ids of capture and calibration.
fn calibrated(server: &Server) -> (String, String) {
    let capture_id = server.upload(&small_capture());
    let source = json!({ "kind": "capture", "capture_id": capture_id });
    let calibration_id = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
    (capture_id, calibration_id)
}

fn of_capture(capture_id: &str, calibration_id: &str, scan: &str, measure: Value) -> Value {
    json!({ "source": { "kind": "capture", "capture_id": capture_id, "scan": scan },
        "calibration_id": calibration_id, "measure": measure })
}

fn found(server: &Server, query: &str) -> Vec<String> {
    let list = server.get(&format!("/api/v1/scans?{query}")).expect(200);
    list["items"].as_array().unwrap().iter().map(|scan| scan["id"].as_str().unwrap().to_owned()).collect()
}

/// All scans, newest first, are found by a part of their common name and by their time, page by page.
fn by_name_and_time(server: &Server, newest_first: &[&str; 2]) {
    let of = |id: &str| server.get(&format!("/api/v1/scans/{id}")).expect(200);
    let [newer_ms, older_ms] = newest_first.map(|id| of(id)["created_at_ms"].as_i64().unwrap());
    assert_eq!(of(newest_first[1])["name"], "gauge");
    assert_eq!(found(server, "name=AUG"), newest_first);
    assert_eq!(found(server, "name=auger"), [""; 0]);
    assert_eq!(found(server, &format!("name=gauge&to_ms={newer_ms}")), newest_first[1..]);
    assert_eq!(found(server, &format!("from_ms={newer_ms}")), newest_first[..1]);
    assert_eq!(found(server, &format!("to_ms={older_ms}")), [""; 0]);
    // The next page is one of the same list.
    let first = server.get("/api/v1/scans?name=g%26x&limit=1").expect(200);
    assert_eq!((first["items"].as_array().unwrap().len(), &first["next"]), (0, &Value::Null));
    let first =
        server.get(&format!("/api/v1/scans?name=Gau%67e&from_ms={older_ms}&judged=true&limit=1")).expect(200);
    let next = first["next"].as_str().unwrap();
    assert!(next.contains(&format!("?name=Gauge&from_ms={older_ms}&judged=true&before=")), "{next}");
    assert_eq!(server.get(next).expect(200)["items"], json!([]));
}

#[test]
fn the_verdict_on_a_part_is_the_worst_of_its_newest_and_filters_lists() {
    let (_folder, server) = fresh();
    let (capture_id, calibration_id) = calibrated(&server);
    let asked = json!([
        { "tool": "step", "nominal_mm": 8.9, "tolerance_mm": 0.5 },
        { "tool": "step", "name": "second step", "nominal_mm": 10.0, "tolerance_mm": 0.5 },
    ]);
    let part = of_capture(&capture_id, &calibration_id, "gauge", asked);
    let part = server.result_of("/api/v1/scans", &part);
    let url = format!("/api/v1/scans/{part}");
    let scan = server.get(&url).expect(200);
    assert_eq!(scan["verdict"], "not_ok", "{scan}");
    let shown: Vec<_> =
        scan["characteristics"].as_array().unwrap().iter().map(|one| one["verdict"].clone()).collect();
    assert_eq!(shown, ["not_ok", "ok"], "newest first");

    // The good characteristic again: the bad one still determines the verdict.
    let measure = |request: Value| server.post(&format!("{url}/measurements"), &request).expect(201);
    measure(json!({ "tool": "step", "nominal_mm": 8.9, "tolerance_mm": 0.5 }));
    assert_eq!(server.get(&url).expect(200)["verdict"], "not_ok");
    // A measurement without limits does not replace a verdict.
    measure(json!({ "tool": "step", "name": "second step" }));
    assert_eq!(server.get(&url).expect(200)["verdict"], "not_ok");

    let plain = of_capture(&capture_id, &calibration_id, "gauge", json!([]));
    let plain = server.result_of("/api/v1/scans", &plain);
    assert!(server.get(&format!("/api/v1/scans/{plain}")).expect(200)["verdict"].is_null());
    assert_eq!(found(&server, "verdict=not_ok"), [part.as_str()]);
    assert_eq!(found(&server, "verdict=ok"), [""; 0]);
    assert_eq!(found(&server, "purpose=production&limit=1"), [plain.as_str()]);
    assert_eq!(found(&server, "judged=false&measured=false"), [plain.as_str()]);
    assert_eq!(found(&server, "judged=true&measured=true"), [part.as_str()]);
    assert_eq!(found(&server, "judged=false&measured=true"), [""; 0]);
    by_name_and_time(&server, &[&plain, &part]);

    // Measured again within its limits: the part is OK.
    measure(json!({ "tool": "step", "name": "second step", "nominal_mm": 8.9, "tolerance_mm": 0.5 }));
    assert_eq!(server.get(&url).expect(200)["verdict"], "ok");
    assert_eq!(found(&server, "verdict=ok"), [part.as_str()]);
}

#[test]
fn an_unmeasurable_characteristic_is_invalid_and_the_scan_is_kept() {
    let (_folder, server) = fresh();
    let (capture_id, calibration_id) = calibrated(&server);
    let nowhere = json!([900.0, 900.0, 900.0, 901.0, 901.0, 901.0]);
    let asked = json!([{ "tool": "sphere", "nominal_mm": 18.9, "tolerance_mm": 0.1, "region_mm": nowhere }]);
    let id = server.result_of("/api/v1/scans", &of_capture(&capture_id, &calibration_id, "sphere", asked));
    let scan = server.get(&format!("/api/v1/scans/{id}")).expect(200);
    assert_eq!((&scan["state"], &scan["verdict"]), (&json!("complete"), &json!("invalid")));
    let recorded = server.get(&format!("/api/v1/scans/{id}/measurements")).expect(200)["items"][0].clone();
    assert!(recorded["result"]["value"].is_null(), "{recorded}");
    let note = recorded["result"]["notes"][0].as_str().unwrap();
    assert!(note.starts_with("not measurable: ") && note.contains("points"), "{note}");
    assert_eq!(found(&server, "verdict=invalid"), [id.as_str()]);
    // The same for a manual measurement; without limits it is an error.
    let url = format!("/api/v1/scans/{id}/measurements");
    let by_hand = json!({ "tool": "step", "nominal_mm": 5.0, "tolerance_mm": 0.1, "region_mm": nowhere });
    assert_eq!(server.post(&url, &by_hand).expect(201)["result"]["verdict"], "invalid");
    server.post(&url, &json!({ "tool": "step", "region_mm": nowhere })).expect(422);
}

#[test]
fn impossible_measurements_are_refused_before_scanning() {
    let (_folder, server) = fresh();
    let refused = |measure: Value, place: &str| {
        let body = json!({ "source": { "kind": "station" }, "from_mm": 0, "to_mm": 1, "measure": measure });
        let problem = server.post("/api/v1/scans", &body).expect(422);
        assert_eq!(problem["pointer"].as_str(), Some(place), "{problem}");
    };
    refused(json!([{ "tool": "sphere", "tolerance_mm": 0.1 }]), "/measure/0/tolerance_mm");
    refused(json!([{ "tool": "plane" }, { "tool": "plane" }]), "/measure/1");
    refused(json!([{ "tool": "sphere", "nominal_mm": 1, "tolerance_mm": -0.1 }]), "/measure/0/tolerance_mm");
}

#[test]
fn the_measurement_plan_is_stored_and_protected_against_lost_updates() {
    let (folder, server) = fresh();
    let url = "/api/v1/measurement-plan";
    let first = server.get(url);
    let tag = first.header("etag").unwrap().to_owned();
    let mut plan = first.expect(200);
    assert_eq!(plan["measure"][0]["tool"], "sphere");
    plan["measure"][0]["tolerance_mm"] = json!(0.02);
    let put = |headers: &[(&str, &str)], plan: &Value| {
        let headers = [headers, &[("content-type", "application/json")]].concat();
        server.send("PUT", url, &headers, plan.to_string().as_bytes())
    };
    put(&[], &plan).expect(428);
    let second = put(&[("if-match", &tag)], &plan);
    let new_tag = second.header("etag").unwrap().to_owned();
    assert_eq!(second.expect(200), plan);
    assert_ne!(tag, new_tag);
    put(&[("if-match", &tag)], &plan).expect(412);
    let mut impossible = plan.clone();
    impossible["step_mm"] = json!(0);
    put(&[("if-match", &new_tag)], &impossible).expect(422);
    server.terminate();

    let again = Server::start(&folder.path().join("data"), &[]);
    let kept = again.get(url);
    assert_eq!(kept.header("etag"), Some(new_tag.as_str()));
    assert_eq!(kept.expect(200), plan);
}

#[test]
fn a_calibration_with_a_failed_verification_is_activated_only_with_confirmation() {
    let (_folder, server) = fresh();
    let (capture_id, calibration_id) = calibrated(&server);
    let verify = |nominal_mm: f64| {
        let source = json!({ "kind": "capture", "capture_id": capture_id, "scan": "gauge" });
        let body = json!({ "reference_part": "gauge", "nominal_mm": nominal_mm, "tolerance_mm": 0.5,
            "scan": { "source": source, "calibration_id": calibration_id } });
        server.result_of("/api/v1/verifications", &body)
    };
    let bad = verify(10.0);
    let scan = server.get(&format!("/api/v1/scans/{}", bad.split('/').next().unwrap())).expect(200);
    assert_eq!((&scan["purpose"], &scan["verdict"]), (&json!("verification"), &json!("not_ok")));
    assert_eq!(found(&server, "purpose=production"), [""; 0]);

    let activate = |despite: bool| {
        let body = json!({ "calibration_id": calibration_id, "despite_verification": despite }).to_string();
        let headers = [("content-type", "application/json")];
        server.send("PUT", "/api/v1/calibrations/active", &headers, body.as_bytes())
    };
    let problem = activate(false).expect(409);
    assert!(problem["detail"].as_str().unwrap().ends_with("is NOT OK"), "{problem}");
    activate(true).expect(200);
    let events = server.get("/api/v1/events").expect(200);
    let event = events["items"].as_array().unwrap().iter().find(|event| event["kind"] == "calibration.activated");
    assert_eq!(event.unwrap()["body"]["verification"], "not_ok", "{events}");
    // A newer passed verification needs no confirmation.
    verify(8.9);
    activate(false).expect(200);
}
