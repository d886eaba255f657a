//! Over HTTP, the simulated station is calibrated and measures parts as accurately as the processing core, and the clouds
//! of the server equal those of the command line byte by byte.

use crate::common::server::Server;
use crate::common::{path, sheaf_ok};
use serde_json::{Value, json};

/// Maximum error of the gauge height: that of the processing core.
const GAUGE_WITHIN_MM: f64 = 0.008;

/// Maximum error of the ball radius: that of the processing core.
const SPHERE_WITHIN_MM: f64 = 0.010;

#[test]
fn over_http_the_twin_is_calibrated_and_gauge_and_sphere_are_measured_accurately() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(&folder.path().join("data"), &[]);
    let calibration = server.result_of("/api/v1/calibrations", &json!({ "source": { "kind": "station" } }));
    server.put("/api/v1/calibrations/active", &json!({ "calibration_id": calibration })).expect(200);
    let range = json!({ "source": { "kind": "station" }, "from_mm": -20, "to_mm": 20, "step_mm": 0.4 });

    let sphere = server.result_of("/api/v1/scans", &range);
    let tool = json!({ "tool": "sphere", "nominal_mm": 18.9 });
    check(&server, &sphere, &tool, SPHERE_WITHIN_MM);

    server.put("/api/v1/simulation/scene", &json!({ "scene": "gauge" })).expect(200);
    let gauge = server.result_of("/api/v1/scans", &range);
    let tool = json!({ "tool": "step", "nominal_mm": 8.9 });
    check(&server, &gauge, &tool, GAUGE_WITHIN_MM);
}

/// Asserts that the measured value is within `within_mm` of the nominal one, which is the truth, and within U.
#[track_caller]
fn check(server: &Server, scan: &str, tool: &Value, within_mm: f64) {
    let made = server.post(&format!("/api/v1/scans/{scan}/measurements"), tool).expect(201);
    let figure = |name: &str| find(&made, name).unwrap_or_else(|| panic!("no {name} in {made:#}"));
    let (value, uncertainty) = (figure("value"), figure("expanded_uncertainty"));
    let error = value - tool["nominal_mm"].as_f64().unwrap();
    println!("{tool}: {value:.4} mm, error {:+.1} µm, U {:.1} µm", 1e3 * error, 1e3 * uncertainty);
    assert!(error.abs() <= within_mm, "{tool}: error {error} mm");
    assert!(error.abs() <= uncertainty, "{tool}: error {error} mm is outside U = {uncertainty} mm");
}

/// The first number of that name anywhere in the value.
fn find(value: &Value, name: &str) -> Option<f64> {
    match value {
        Value::Object(map) => {
            map.get(name).and_then(Value::as_f64).or_else(|| map.values().find_map(|inner| find(inner, name)))
        }
        Value::Array(list) => list.iter().find_map(|inner| find(inner, name)),
        _ => None,
    }
}

#[test]
fn the_cloud_of_the_server_equals_that_of_the_command_line_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let capture = crate::common::small_capture();
    let (calibration, cloud) = (path(folder.path(), "cal.json"), path(folder.path(), "gauge.ply"));
    let capture_path = capture.display().to_string();
    sheaf_ok(&["calibrate", &capture_path, "-o", &calibration]);
    sheaf_ok(&["scan", &capture_path, "-c", &calibration, "--scan", "gauge", "-o", &cloud]);
    for threads in ["1", "2", "3"] {
        let data = folder.path().join(format!("data-{threads}"));
        let server = Server::start_with(&data, &[], &[("RAYON_NUM_THREADS", threads)]);
        let capture_id = server.upload(&capture);
        let source = json!({ "kind": "capture", "capture_id": capture_id });
        let id = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
        let document = server.get(&format!("/api/v1/calibrations/{id}")).expect(200)["calibration"].clone();
        let written: Value = serde_json::from_slice(&std::fs::read(&calibration).unwrap()).unwrap();
        assert_eq!(document, written, "with {threads} threads");
        server.put("/api/v1/calibrations/active", &json!({ "calibration_id": id })).expect(200);
        let source = json!({ "kind": "capture", "capture_id": capture_id, "scan": "gauge" });
        let scan = server.result_of("/api/v1/scans", &json!({ "source": source }));
        let bytes = server.get(&format!("/api/v1/scans/{scan}/cloud?format=ply")).body;
        assert!(bytes == std::fs::read(&cloud).unwrap(), "the clouds differ with {threads} threads");
    }
}
