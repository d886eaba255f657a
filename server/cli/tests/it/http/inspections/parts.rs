//! Parts on the simulated station, inspected over the API: a changed one is rejected, nothing is lost, held or doubled by
//! accident. That values lie within their uncertainty is the matter of `metrology`.

use std::time::Instant;

use serde_json::{Value, json};

use super::{block_recipe, evaluation, inspect, inspected, models, place_block, studies};
use crate::common::server::Server;
use crate::http::fresh;

/// Defect of a part, mm: twice the tolerance of the recipe.
const DEFECT_MM: f64 = 0.06;

fn serials(server: &Server, query: &str) -> Vec<String> {
    let (mut next, mut serials) = (Some(format!("/api/v1/inspections{query}")), Vec::new());
    while let Some(page) = next {
        let list = server.get(&page).expect(200);
        let items = list["items"].as_array().unwrap().iter();
        serials.extend(items.map(|item| item["serial"].as_str().unwrap().to_owned()));
        next = list["next"].as_str().map(str::to_owned);
    }
    serials
}

#[test]
fn parts_are_inspected_by_a_recipe_and_a_changed_one_is_rejected() {
    let (folder, server) = fresh();
    let calibration = json!({ "source": { "kind": "station" }, "n_poses": 8 });
    let calibration_id = server.result_of("/api/v1/calibrations", &calibration);
    server.put("/api/v1/calibrations/active", &json!({ "calibration_id": calibration_id })).expect(200);
    let mut recipe = block_recipe(DEFECT_MM / 2.0);
    (recipe["number"], recipe["serial_pattern"]) = (json!(12), json!("BL-[0-9]+"));
    let first = json!({ "id": "block", "reason": "first", "recipe": recipe });
    let version = server.post("/api/v1/recipes", &first).expect(201);

    refusals(&server);

    // Recipe by id, by number and by the serial number rule; the second part is too low.
    place_block(&server, 8.9);
    let part = json!({ "recipe": "block", "serial": "BL-1", "order": "4711", "attributes": { "shift": "early" } });
    let good = inspected(&server, &part);
    assert_eq!(
        (&good["verdict"], &good["seq"], &good["order"]),
        (&json!("ok"), &json!(1), &json!("4711")),
        "{good:#}"
    );
    assert_eq!((&good["recipe"]["version"], &good["recipe"]["digest"]), (&json!(1), &version["digest"]));
    assert_eq!((&good["calibration_id"], &good["simulated"]), (&json!(calibration_id), &json!(true)));
    let height = &good["results"][0];
    assert_eq!(
        (&height["nominal"], &height["upper"], &height["coverage_factor"]),
        (&json!(8.9), &json!(0.03), &json!(2.0))
    );
    assert_eq!(height["attributes"], json!({ "K2001": "1", "line": 4 }));
    assert_eq!(good["features"].as_array().unwrap().len(), 2);
    server.get(good["scan_href"].as_str().unwrap()).expect(200);
    assert_eq!(server.get(good["cloud_href"].as_str().unwrap()).status, 200);
    print_overhead(&server, &good);

    place_block(&server, 8.9 - DEFECT_MM);
    let bad = inspected(&server, &json!({ "recipe": 12, "serial": "BL-2" }));
    let height = &bad["results"][0];
    assert_eq!((&bad["verdict"], &height["reason"]), (&json!("not_ok"), &Value::Null), "{bad:#}");
    println!("defect of {DEFECT_MM} mm: error {} mm, U {} mm", height["error"], height["expanded_uncertainty"]);
    place_block(&server, 8.9);
    let by_rule = inspected(&server, &json!({ "serial": "BL-3" }));
    assert_eq!(
        (&by_rule["verdict"], &by_rule["recipe"]["id"], &by_rule["seq"]),
        (&json!("ok"), &json!("block"), &json!(3))
    );

    lists(&server);
    exports(&server);
    reports_and_statistics(&server, &bad);
    studies::accepted(&server, &bad);
    evaluation::same_as_inspected(&server, [&good, &bad], &recipe);
    re_evaluated(&server, &bad, &recipe);
    let study = studies::begun(&server);
    held(&server);
    studies::counted(&server, &study);
    let server = restarted(&folder.path().join("data"), server);
    models::compared(&server, &good, &bad, DEFECT_MM);
}

/// Prints the time of an inspection beside the acquisition; not asserted, since debug builds on busy machines are slow.
pub fn print_overhead(server: &Server, inspection: &Value) {
    let job = server.get(&format!("/api/v1/jobs/{}", inspection["job_id"].as_str().unwrap())).expect(200);
    let report = server.get(inspection["scan_href"].as_str().unwrap()).expect(200)["report"].clone();
    let at = |name: &str| job[name].as_f64().unwrap() / 1e3;
    let timing = &report["timing"];
    let overhead_s = at("ended_at_ms") - at("started_at_ms") - timing["acquisition_s"].as_f64().unwrap();
    println!(
        "{} points: {overhead_s:.2} s beside the acquisition, of it {:.2} s for the cloud and {:.2} s to measure",
        report["n_points"],
        timing["evaluation_s"].as_f64().unwrap(),
        timing["measuring_s"].as_f64().unwrap(),
    );
}

fn refusals(server: &Server) {
    let refused = |body: Value, status: u16, place: &str| {
        let problem = inspect(server, "", None, &body).expect(status);
        assert_eq!(problem["pointer"], place, "{problem}");
        assert!(problem["remedy"].is_string(), "{problem}");
    };
    refused(json!({ "recipe": "lid", "serial": "S" }), 422, "/recipe");
    refused(json!({ "recipe": "block@9", "serial": "S" }), 422, "/recipe");
    refused(json!({ "recipe": 13, "serial": "S" }), 422, "/recipe");
    refused(json!({ "recipe": "@", "serial": "S" }), 422, "/recipe");
    refused(json!({ "serial": "no rule is about it" }), 422, "/recipe");
    refused(json!({ "recipe": "block", "serial": "" }), 422, "/serial");
    let mut for_a_door = block_recipe(DEFECT_MM);
    for_a_door["outputs"] = json!(["mes"]);
    let for_a_door = json!({ "id": "for-a-door", "reason": "first", "recipe": for_a_door });
    server.post("/api/v1/recipes", &for_a_door).expect(201);
    refused(json!({ "recipe": "for-a-door", "serial": "S" }), 422, "/recipe");
    let nowhere = json!({ "kind": "capture", "capture_id": "none" });
    refused(json!({ "recipe": "block", "serial": "S", "source": nowhere }), 422, "/source/capture_id");
    refused(json!({ "recipe": "block", "serial": "S", "source": { "kind": "cloud" } }), 422, "/source/kind");
    let too_long = inspect(server, "?wait_s=31", None, &json!({ "recipe": "block", "serial": "S" })).expect(400);
    assert_eq!(too_long["pointer"], "query/wait_s");
    assert_eq!(serials(server, ""), [""; 0]);
}

fn lists(server: &Server) {
    assert_eq!(serials(server, "?limit=2"), ["BL-3", "BL-2", "BL-1"]);
    assert_eq!(serials(server, "?after_seq=0&limit=2"), ["BL-1", "BL-2", "BL-3"]);
    assert_eq!(serials(server, "?after_seq=2"), ["BL-3"]);
    assert_eq!(serials(server, "?verdict=not_ok"), ["BL-2"]);
    assert_eq!(serials(server, "?serial=BL-1&recipe=block%401&order=4711"), ["BL-1"]);
    assert_eq!(serials(server, "?recipe=block@2"), [""; 0]);
    assert_eq!(serials(server, "?to_ms=1"), [""; 0]);
    server.get("/api/v1/inspections?after_seq=1&before=x").expect(400);
    let list = server.get("/api/v1/inspections?limit=1").expect(200);
    assert!(list["items"][0]["results"].is_array() && list["items"][0]["features"].is_null(), "{list}");
    // The events were stored with the inspections, in the order of their sequence numbers.
    let events = server.get("/api/v1/events?limit=200").expect(200);
    let finished =
        events["items"].as_array().unwrap().iter().filter(|event| event["kind"] == "inspection.finished");
    let finished: Vec<_> =
        finished.map(|event| (event["body"]["seq"].clone(), event["body"]["verdict"].clone())).collect();
    assert_eq!(finished, [(json!(1), json!("ok")), (json!(2), json!("not_ok")), (json!(3), json!("ok"))]);
}

/// The selection as a table, oldest first, with a row per characteristic.
fn exports(server: &Server) {
    let table = |query: &str| {
        let reply = server.get(&format!("/api/v1/inspections/export{query}"));
        assert_eq!((reply.status, reply.header("content-type")), (200, Some("text/csv; charset=utf-8")));
        assert!(reply.header("content-disposition").unwrap().contains("inspections.csv"));
        let text = String::from_utf8(reply.body).unwrap();
        assert!(text.starts_with("inspection_id,seq,serial,order,") && text.ends_with("\r\n"), "{text}");
        let cell = |line: &str, column: usize| line.split(',').nth(column).unwrap().to_owned();
        text.lines().skip(1).map(|line| [2, 8, 9].map(|column| cell(line, column))).collect::<Vec<_>>()
    };
    let rows = table("?format=csv");
    let serials: Vec<_> = rows.iter().map(|[serial, ..]| serial.as_str()).collect();
    assert!(
        serials.is_sorted() && serials.first() == Some(&"BL-1") && serials.last() == Some(&"BL-3"),
        "{rows:?}"
    );
    let rejected = table("?verdict=not_ok&recipe=block");
    assert!(rejected.iter().all(|[serial, verdict, _]| (serial.as_str(), verdict.as_str()) == ("BL-2", "not_ok")));
    assert!(rejected.iter().any(|[.., characteristic]| characteristic == "height"), "{rejected:?}");
    assert!(
        table("?serial=none").is_empty() && table("?recipe=block@2").is_empty() && table("?to_ms=1").is_empty()
    );
    let refused = server.get("/api/v1/inspections/export?limit=1").expect(400);
    assert!(refused["pointer"] == "query" && refused["detail"].as_str().unwrap().contains("limit"), "{refused}");
    server.get("/api/v1/inspections/export?format=pdf").expect(400);
    exports_for_q_das(server);
}

/// The same selection as one Q-DAS file: the part once, then the values, oldest first.
fn exports_for_q_das(server: &Server) {
    let reply = server.get("/api/v1/inspections/export?format=dfq&recipe=block");
    assert_eq!((reply.status, reply.header("content-type")), (200, Some("application/octet-stream")));
    assert!(reply.header("content-disposition").unwrap().contains("inspections.dfq"));
    let text = String::from_utf8(reply.body).unwrap();
    let of = |key: &str| -> Vec<String> {
        let lines = text.split("\r\n").filter_map(|line| line.strip_prefix(&format!("{key} ")));
        lines.map(str::to_owned).collect()
    };
    assert_eq!((of("K1001/1"), of("K2002/1")), (vec!["block".to_owned()], vec!["height".to_owned()]));
    assert_eq!((of("K0014/1"), of("K0001/1").len()), (["BL-1", "BL-2", "BL-3"].map(str::to_owned).to_vec(), 3));
    assert_eq!(of("K0053/1"), ["4711"]);
}

fn reports_and_statistics(server: &Server, inspection: &Value) {
    let report = format!("/api/v1/inspections/{}/report", inspection["id"].as_str().unwrap());
    let page = server.get(&report);
    assert_eq!((page.status, page.header("content-type")), (200, Some("text/html; charset=utf-8")));
    let page = String::from_utf8(page.body).unwrap();
    assert!(page.contains("NOT OK") && page.contains("BL-2") && page.contains("<svg"), "{page}");
    assert!(page.contains("<h2>Deviations</h2>") && page.contains("beyond a limit by more than U"), "{page}");
    let document = server.get(&format!("{report}?format=pdf"));
    assert_eq!((document.status, document.header("content-type")), (200, Some("application/pdf")));
    assert!(document.body.starts_with(b"%PDF-"));
    let text = String::from_utf8_lossy(&document.body);
    assert!(text.contains("/I1 Do") && text.contains("/I2 Do"), "the map of deviations, and the cloud");
    let values = server.get(&format!("{report}?format=dfq"));
    assert!(values.header("content-disposition").unwrap().contains("BL-2_2.dfq"));
    assert!(values.body.starts_with(b"K0100 1\r\nK1001 block\r\n"), "{:?}", values.body);

    let of = "/api/v1/recipes/block/characteristics/height";
    let chart = server.get(&format!("{of}/control-chart")).expect(200);
    let readings = chart["readings"].as_array().unwrap();
    let serials: Vec<_> = readings.iter().map(|reading| reading["serial"].as_str().unwrap()).collect();
    assert_eq!((serials, &chart["preliminary"]), (vec!["BL-1", "BL-2", "BL-3"], &json!(true)));
    assert_eq!((&readings[1]["value"], &chart["nominal"]), (&inspection["results"][0]["value"], &json!(8.9)));
    assert_eq!(chart["capability"]["verdict"], "undecided", "{chart:#}");
    let problem = server.get(&format!("{of}/type-1-study?serial=BL-1")).expect(400);
    assert_eq!(problem["pointer"], "query/reference");
    server.get(&format!("{of}/type-1-study?serial=BL-1&reference=8.9")).expect(422);
    assert_eq!(server.get(&format!("{of}/type-1-study?reference=8.9")).expect(422)["pointer"], "query/serial");
    let problem = server.get(&format!("{of}/gauge-rr")).expect(422);
    assert!(problem["detail"].as_str().unwrap().contains("2 trials"), "{problem}");
    server.get("/api/v1/recipes/block/characteristics/width/control-chart").expect(404);
}

/// With a wider version of the recipe the rejected part is OK; its first verdict is kept.
fn re_evaluated(server: &Server, bad: &Value, recipe: &Value) {
    let mut wider = recipe.clone();
    wider["plan"]["characteristics"][0]["lower"] = json!(-0.2);
    let body = json!({ "reason": "agreed with the customer", "recipe": wider }).to_string();
    let headers = [("content-type", "application/json"), ("if-match", "\"1\"")];
    server.send("POST", "/api/v1/recipes/block/versions", &headers, body.as_bytes()).expect(201);
    let href = format!("/api/v1/inspections/{}", bad["id"].as_str().unwrap());
    let accepted = server.post(&format!("{href}/re-evaluate"), &json!({}));
    accepted.expect(202);
    let job = server.wait_for_job(accepted.header("location").unwrap());
    let anew = server.get(job["result"]["href"].as_str().unwrap()).expect(200);
    assert_eq!(
        (&anew["verdict"], &anew["recipe"]["version"], &anew["seq"]),
        (&json!("ok"), &json!(2), &json!(4)),
        "{anew:#}"
    );
    assert_eq!((&anew["re_evaluated_from"], &anew["scan_id"]), (&bad["id"], &bad["scan_id"]));
    assert_eq!(anew["changed"], json!([{ "id": "height", "before": "not_ok", "after": "ok" }]));
    assert_eq!(anew["results"][0]["value"], bad["results"][0]["value"], "the same scan, the same value");
    assert_eq!(&server.get(&href).expect(200), bad, "the first stays as it was");
    let refused = server.post(&format!("{href}/re-evaluate"), &json!({ "calibration_id": "none" })).expect(422);
    assert_eq!(refused["pointer"], "/calibration_id", "{refused}");
}

/// While the queue is held an inspection waits and other jobs run; its key returns the same job and later its result.
fn held(server: &Server) {
    let held = server.post("/api/v1/inspection-queue/hold", &json!({ "reason": "fixture" })).expect(200);
    assert_eq!((&held["held"], &held["reason"]), (&json!(true), &json!("fixture")));
    let part = json!({ "recipe": "block@1", "serial": "BL-5" });
    let begun = Instant::now();
    let waiting = inspect(server, "?wait_s=1", Some("part-5"), &part).expect(202);
    assert_eq!(waiting["state"], "queued");
    assert!(begun.elapsed().as_secs_f64() >= 1.0);
    assert_eq!(server.get("/api/v1/inspection-queue").expect(200)["n_waiting"], 1);
    let scan = json!({ "source": { "kind": "station" }, "from_mm": -1.0, "to_mm": 1.0, "step_mm": 1.0 });
    server.result_of("/api/v1/scans", &scan);
    assert_eq!(inspect(server, "", Some("part-5"), &part).expect(202)["id"], waiting["id"]);
    inspect(server, "", Some("part-5"), &json!({ "recipe": "block@1", "serial": "BL-6" })).expect(422);

    assert_eq!(server.post("/api/v1/inspection-queue/resume", &json!(null)).expect(200)["held"], false);
    let job = server.wait_for_job(&format!("/api/v1/jobs/{}", waiting["id"].as_str().unwrap()));
    assert_eq!(job["state"], "succeeded", "{job:#}");
    // The key with `wait_s` is the same request: it returns the result, and no part is inspected twice.
    let done = inspect(server, "?wait_s=30", Some("part-5"), &part).expect(200);
    assert_eq!((&done["id"], &done["verdict"]), (&job["result"]["id"], &json!("ok")));
    assert_eq!(serials(server, "?serial=BL-5"), ["BL-5"]);
}

/// Killed in the middle of an inspection: no verdict, its scan is partial, the numbers go on where they were, and a hold is
/// still one.
fn restarted(data: &std::path::Path, server: Server) -> Server {
    let accepted = inspect(&server, "", None, &json!({ "recipe": "block@1", "serial": "BL-7" }));
    accepted.expect(202);
    let location = accepted.header("location").unwrap().to_owned();
    while !server.get(&location).expect(200)["message"].as_str().unwrap().starts_with("row") {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    server.post("/api/v1/inspection-queue/hold", &json!({})).expect(200);
    server.kill();
    let server = Server::start(data, &[]);
    let job = server.get(&location).expect(200);
    assert_eq!(job["state"], "interrupted", "{job:#}");
    assert_eq!(serials(&server, "?serial=BL-7"), [""; 0]);
    assert_eq!(server.get("/api/v1/inspection-queue").expect(200)["held"], true);
    server.post("/api/v1/inspection-queue/resume", &json!(null)).expect(200);
    place_block(&server, 8.9);
    let again = inspected(&server, &json!({ "recipe": "block@1", "serial": "BL-7" }));
    assert_eq!((&again["verdict"], &again["seq"]), (&json!("ok"), &json!(6)), "{again:#}");
    server
}
