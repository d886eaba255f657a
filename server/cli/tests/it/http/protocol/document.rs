//! The API document: up to date, and confirmed by a fuzzer.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};

use crate::common::server::Server;
use crate::common::{out, sheaf_ok, small_capture};
use crate::http::inspections::{block_recipe, block_stl};
use crate::http::recordings::recorded_live_view;

#[test]
fn the_checked_in_documents_match_the_program() {
    let documents: [(&[&str], &str, &str); 4] = [
        (&["openapi"], "openapi.json", "\"/api/v1/inspections\""),
        (&["openapi", "--events"], "events.md", "| `job.failed` |"),
        (&["openapi", "--registers", "markdown"], "modbus.md", "result_ack"),
        (&["openapi", "--registers", "csv"], "modbus.csv", "result_ack"),
    ];
    for (arguments, file, part) in documents {
        let path = format!("{}/../../openapi/{file}", env!("CARGO_MANIFEST_DIR"));
        let checked_in = std::fs::read_to_string(path).unwrap();
        assert!(checked_in.contains(part), "{file} lacks {part}");
        let printed = out(&sheaf_ok(arguments));
        assert!(printed == checked_in, "{file}: run `cargo xtask openapi` and look at what changed");
    }
}

/// Examples per operation, in addition to the corner cases of the fuzzer.
const EXAMPLES: &str = "5";

/// The only route that enables faults; with a fault, a 503 of a device is correct.
const FAULTS: &str = "/api/v1/simulation/faults";

/// One resource of each kind, so that the fuzzer gets past the 404s.
fn existing_resources(server: &Server) -> Value {
    let capture_id = server.upload(&small_capture());
    let source = json!({ "kind": "capture", "capture_id": capture_id });
    let calibration_id = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
    server.put("/api/v1/calibrations/active", &json!({ "calibration_id": calibration_id })).expect(200);
    let scan = json!({ "source": { "kind": "capture", "capture_id": capture_id, "scan": "gauge" } });
    let scan_id = server.result_of("/api/v1/scans", &scan);
    let measured = server.post(&format!("/api/v1/scans/{scan_id}/measurements"), &json!({ "tool": "plane" }));
    let profiles = server.get(&format!("/api/v1/scans/{scan_id}/profiles")).expect(200);
    let profiles = profiles["items"].as_array().unwrap();
    let sequences: Vec<&Value> = profiles.iter().map(|profile| &profile["sequence"]).take(3).collect();
    let export = json!({ "what": "cloud", "format": "csv" });
    server.result_of(&format!("/api/v1/scans/{scan_id}/exports"), &export);
    let recipe = json!({ "id": "block", "reason": "first", "recipe": block_recipe(0.05) });
    server.post("/api/v1/recipes", &recipe).expect(201);
    let plate = json!({ "artefact": "table", "form_mm": 0.001, "mpe_flatness_mm": 0.5 });
    let study = json!({ "name": "table", "plan": { "acceptance": { "plate": plate } } });
    let study_id = server.post("/api/v1/studies", &study).expect(201)["id"].clone();
    let position = json!({ "procedure": "plate", "scan_id": scan_id });
    server.post(&format!("/api/v1/studies/{}/positions", study_id.as_str().unwrap()), &position).expect(201);
    let (session_id, image) = session_with_an_image(server);
    let recording_id = recorded_live_view(server);
    let stl = block_stl([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0]]);
    let headers = [("content-type", "application/octet-stream")];
    let model_id = server.send("POST", "/api/v1/models?name=cube.stl", &headers, &stl).expect(201)["id"].clone();
    let jobs = server.get("/api/v1/jobs").expect(200);
    let job_ids: Vec<&Value> = jobs["items"].as_array().unwrap().iter().map(|job| &job["id"]).collect();
    json!({
        "doors": { "name": ["share"] },
        "captures": { "id": [capture_id] },
        "calibrations": { "id": [calibration_id], "with": [calibration_id] },
        "calibration-sessions": { "id": [session_id], "artifact": [image] },
        "jobs": { "id": job_ids },
        "models": { "id": [model_id] },
        "recordings": { "id": [recording_id] },
        "recipes": { "id": ["block"], "version": [1] },
        "studies": { "id": [study_id] },
        "scans": {
            "id": [scan_id],
            "measurement_id": [measured.expect(201)["id"]],
            "file": ["cloud.csv"],
            "sequence": sequences,
        },
    })
}

/// A server on a fresh data folder that writes events to a folder.
fn with_a_door(folder: &Path) -> Server {
    let [data, share] = ["data", "share"].map(|name| folder.join(name));
    [&data, &share].into_iter().for_each(|folder| std::fs::create_dir(folder).unwrap());
    let door = format!("[[doors.folder]]\nname = \"share\"\npath = \"{}\"\n", share.display());
    std::fs::write(data.join("sheaf.toml"), door).unwrap();
    Server::start(&data, &[])
}

/// Ids of a session and of the image of its only pose.
fn session_with_an_image(server: &Server) -> (Value, Value) {
    let session_id = server.post("/api/v1/calibration-sessions", &json!({})).expect(201)["id"].clone();
    server.put("/api/v1/simulation/board", &json!({ "place": "pose", "pose": 0 })).expect(204);
    let holder = json!({ "holder": "Anna", "take_over": true });
    let control = server.post("/api/v1/station/control", &holder).expect(201);
    let headers = [("sheaf-control", control["id"].as_str().unwrap())];
    let poses = format!("/api/v1/calibration-sessions/{}/poses", session_id.as_str().unwrap());
    let session = server.send("POST", &poses, &headers, &[]).expect(200);
    (session_id, session["body"]["poses"][0]["board"]["image"]["artifact"].clone())
}

#[test]
fn a_fuzzer_finds_no_server_error_and_no_undocumented_response() {
    let Some(python) = reference::python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let server = with_a_door(folder.path());
    let known = existing_resources(&server);
    let before = answers_by_route(&server);
    let checks = "not_a_server_error,status_code_conformance,content_type_conformance,\
                  response_schema_conformance,response_headers_conformance";
    let output = Command::new(python)
        .args(["-m", "schemathesis.cli", "run"])
        .arg(format!("{}/openapi.json", server.url))
        .args(["--checks", checks, "--max-examples", EXAMPLES, "--phases", "examples,coverage,fuzzing"])
        .args(["--exclude-path", FAULTS, "--seed", "1", "--no-color"])
        .env("SCHEMATHESIS_HOOKS", concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/http/protocol/fuzzer_hooks.py"))
        .env("SHEAF_KNOWN_IDS", known.to_string())
        // Recorded failures must not affect the next run.
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = out(&output);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("passed"), "{said}");
    let answers = answers_by_route(&server);
    let well =
        |answers: &BTreeMap<(String, u16), u64>, route: &str| answers.get(&(route.to_owned(), 200)).copied();
    let met = |route: &str| well(&answers, route).unwrap_or(0) - well(&before, route).unwrap_or(0);
    let (met, missed): (Vec<_>, Vec<_>) =
        readable_resources().into_iter().map(|route| (met(&route), route)).partition(|(n_times, _)| *n_times > 0);
    eprintln!("answered with 200: {met:#?}");
    assert!(missed.is_empty(), "the fuzzer never met a thing behind {missed:#?}: {answers:#?}");
}

/// Inspections need a scan of the station and its own calibration: `inspections/parts.rs` reads them. The only door, a
/// folder, has no registers: `doors/mod.rs` reads those of a Modbus door.
const NOT_HERE: [&str; 6] = [
    "/api/v1/doors/{name}/registers",
    "/api/v1/inspections/{id}",
    "/api/v1/inspections/{id}/report",
    "/api/v1/recipes/{id}/characteristics/{characteristic}/control-chart",
    "/api/v1/recipes/{id}/characteristics/{characteristic}/gauge-rr",
    "/api/v1/recipes/{id}/characteristics/{characteristic}/type-1-study",
];

/// All paths of the document that read one resource.
fn readable_resources() -> Vec<String> {
    let document: Value = serde_json::from_str(&out(&sheaf_ok(&["openapi"]))).unwrap();
    let read = document["paths"].as_object().unwrap().iter().filter(|(_, item)| item["get"].is_object());
    let routes =
        read.map(|(path, _)| path.clone()).filter(|path| path.contains('{') && !NOT_HERE.contains(&path.as_str()));
    let routes: Vec<String> = routes.collect();
    assert!(routes.iter().any(|path| path.ends_with("/profiles/{sequence}")), "{routes:#?}");
    routes
}

/// Number of responses by route and status, from the metrics of the server.
fn answers_by_route(server: &Server) -> BTreeMap<(String, u16), u64> {
    let figures = String::from_utf8(server.get("/metrics").body).unwrap();
    let lines = figures.lines().filter(|line| line.starts_with("sheaf_http_requests_total{"));
    let mut answers = BTreeMap::new();
    for line in lines {
        let label = |name: &str| line.split_once(&format!("{name}=\"")).unwrap().1.split('"').next().unwrap();
        let key = (label("route").to_owned(), label("status").parse().unwrap());
        *answers.entry(key).or_default() += line.rsplit(' ').next().unwrap().parse::<u64>().unwrap();
    }
    answers
}
