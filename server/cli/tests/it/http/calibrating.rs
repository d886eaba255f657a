//! Board detection before an image is captured, and the stored points of residual maps.

use serde_json::{Value, json};
use tempfile::TempDir;

use super::fresh;
use crate::common::server::Server;
use crate::common::{copy_of_small, edit_manifest};

/// Inner corners of the simulated station's board.
const CORNERS: usize = 88;

/// Sharp corners are located to hundredths of a pixel; a wrong assignment to the board would be off by whole squares.
const RMS_PX: f64 = 0.1;

#[track_caller]
fn hold_board(server: &Server, pose: usize) {
    server.put("/api/v1/simulation/board", &json!({ "place": "pose", "pose": pose })).expect(204);
}

#[track_caller]
fn look(server: &Server, session: &str) -> Value {
    server.post(&format!("/api/v1/calibration-sessions/{session}/detect-board"), &json!(null)).expect(200)
}

#[test]
fn exposures_of_a_session_apply_to_its_next_images() {
    let (_folder, server) = fresh();
    let session = server.post("/api/v1/calibration-sessions", &json!({})).expect(201);
    let id = session["id"].as_str().unwrap();
    let url = format!("/api/v1/calibration-sessions/{id}/exposures");
    let exposures = |laser_power: f64| {
        json!({ "board_exposure_us": 15_000.0, "laser_exposure_us": 800.0, "laser_power": laser_power,
            "background_above_levels": null })
    };
    let problem = server.put(&url, &exposures(1.5)).expect(422);
    assert_eq!(problem["pointer"], "/laser_power");
    let put = |version: &str| {
        let headers = [("content-type", "application/json"), ("if-match", version)];
        server.send("PUT", &url, &headers, exposures(0.5).to_string().as_bytes())
    };
    put("\"7\"").expect(412);
    assert_eq!(put("\"1\"").expect(200)["body"]["exposures"], exposures(0.5));
    let next = server.post("/api/v1/calibration-sessions", &json!({})).expect(201);
    assert_eq!(next["body"]["exposures"], exposures(0.5), "those of the newest session");
    hold_board(&server, 0);
    let control = server.post("/api/v1/station/control", &json!({ "holder": "Anna" })).expect(201);
    let headers = [("sheaf-control", control["id"].as_str().unwrap())];
    let poses = format!("/api/v1/calibration-sessions/{id}/poses");
    let pose = &server.send("POST", &poses, &headers, &[]).expect(200)["body"]["poses"][0];
    assert_eq!(pose["board"]["image"]["exposure_us"], 15_000.0);
    assert_eq!(
        (&pose["laser"]["image"]["exposure_us"], &pose["laser"]["background"]),
        (&json!(800.0), &Value::Null)
    );
}

#[test]
fn board_detection_returns_what_an_image_would_show_and_stores_nothing() {
    let (_folder, server) = fresh();
    let defaults = server.get("/api/v1/calibration-sessions/defaults").expect(200);
    let session = server.post("/api/v1/calibration-sessions", &json!({})).expect(201);
    for part in ["target", "projector", "exposures"] {
        assert_eq!(session["body"][part], defaults[part]);
    }
    let id = session["id"].as_str().unwrap();
    let nothing = look(&server, id);
    assert_eq!(nothing["corners"], json!([]));
    assert!(nothing["problem"].as_str().unwrap().contains("hold the whole board in the image"), "{nothing}");
    hold_board(&server, 0);
    let seen = look(&server, id);
    assert_eq!(seen["corners"].as_array().unwrap().len(), CORNERS, "{}", seen["problem"]);
    assert_eq!((&seen["tilt_deg"], &seen["problem"]), (&Value::Null, &Value::Null));
    assert!(!seen["coverage_cells"].as_array().unwrap().is_empty());
    assert!(seen["sequence"].as_u64() > nothing["sequence"].as_u64());
    let pose = || {
        // Control is taken again for each image: on a slow machine the lease of 5 s may have expired.
        let holder = json!({ "holder": "Anna", "take_over": true });
        let control = server.post("/api/v1/station/control", &holder).expect(201);
        let headers = [("sheaf-control", control["id"].as_str().unwrap())];
        server.send("POST", &format!("/api/v1/calibration-sessions/{id}/poses"), &headers, &[]).expect(200)
    };
    pose();
    hold_board(&server, 1);
    let kept = pose();
    // With this board there are three images: enough for tilt and distance.
    hold_board(&server, 2);
    let seen = look(&server, id);
    assert!((5.0..35.0).contains(&seen["tilt_deg"].as_f64().unwrap()), "{seen}");
    assert!((300.0..500.0).contains(&seen["distance_mm"].as_f64().unwrap()), "{seen}");
    assert!(seen["rms_px"].as_f64().unwrap() < RMS_PX, "{seen}");
    let after = server.get(&format!("/api/v1/calibration-sessions/{id}")).expect(200);
    assert_eq!(after, kept);
    server.post("/api/v1/calibration-sessions/nowhere/detect-board", &json!(null)).expect(404);
}

/// Gives the camera hot pixels and a fixed pattern, and takes a dark frame of them behind the covered lens.
#[track_caller]
fn take_dark_frame(server: &Server) -> Value {
    const FAULTS: &str = "/api/v1/simulation/faults";
    for (name, value) in [("sensor_defects", json!(6.0)), ("lens_covered", json!(null))] {
        server.put(FAULTS, &json!({ "name": name, "value": value })).expect(200);
    }
    let control = server.post("/api/v1/station/control", &json!({ "holder": "Anna" })).expect(201);
    let headers = [("content-type", "application/json"), ("sheaf-control", control["id"].as_str().unwrap())];
    let taken =
        server.send("POST", "/api/v1/devices/camera/dark-frame", &headers, b"{\"n_frames\": 8}").expect(200);
    server.send("DELETE", "/api/v1/station/control", &headers[1..], &[]).expect(204);
    server.send("DELETE", &format!("{FAULTS}/lens_covered"), &[], &[]).expect(204);
    taken
}

#[test]
fn a_calibration_stores_the_points_of_its_residual_maps_and_its_dark_frame() {
    let (folder, server) = fresh();
    let dark = take_dark_frame(&server);
    let job = json!({ "source": { "kind": "station" }, "n_poses": 6 });
    let id = server.result_of("/api/v1/calibrations", &job);
    let residuals = server.get(&format!("/api/v1/calibrations/{id}/residuals")).expect(200);
    let item = server.get(&format!("/api/v1/calibrations/{id}")).expect(200);
    // Two images of each pose, and those of the board on the stage.
    let correction = &item["summary"]["correction"];
    assert_eq!(correction["n_corrected"], correction["n_images"], "{correction}");
    assert!(correction["n_images"].as_u64().unwrap() > 12, "{correction}");
    let used = json!({ "used": "full", "taken_at_ms": dark["taken_at_ms"], "exposure_us": dark["exposure_us"],
        "n_hot_pixels": dark["n_hot_pixels"] });
    assert_eq!(correction["dark_frames"], json!([used]));
    let report = server.get(&format!("/api/v1/calibrations/{id}/report"));
    let page = String::from_utf8(report.body).unwrap();
    let words = format!("All {} images were corrected.", correction["n_images"]);
    assert!(page.contains("Dark frame") && page.contains(&words), "{words}");
    assert!(page.contains(&format!("<td>{}</td>", dark["n_hot_pixels"])), "{dark}");
    let orders: Vec<_> =
        residuals["orders"].as_array().unwrap().iter().map(|order| order["order"].clone()).collect();
    assert_eq!(json!(orders), item["calibration"]["orders"]);
    // The response contains the complete document in the format of the calibration crate.
    let returned = &item["calibration"];
    let document = calibration::CalibrationDocument::parse(&returned.to_string()).unwrap();
    assert_eq!(&serde_json::from_str::<Value>(&document.to_json()).unwrap(), returned);
    assert!(returned["stage"]["straightness"]["sigma_mm"].is_number(), "{returned:#}");
    assert!(returned["report"]["camera"]["termination"].is_string(), "{returned:#}");
    // The RMS of the points equals that of the record: they are the same corners.
    let corners = residuals["corners"].as_array().unwrap();
    let squares = corners.iter().map(|corner| {
        let at = |idx: usize| corner[idx].as_f64().unwrap();
        at(2).powi(2) + at(3).powi(2)
    });
    let rms_px = (squares.sum::<f64>() / corners.len() as f64).sqrt();
    let stated_px = item["summary"]["corner_rms_px"].as_f64().unwrap();
    // f32 has seven digits.
    assert!((rms_px / stated_px - 1.0).abs() < 1e-4, "{rms_px} px, {stated_px} px");
    for order in residuals["orders"].as_array().unwrap() {
        let poses = order["points"].as_array().unwrap().iter().map(|point| point[0].as_f64().unwrap());
        assert!(poses.clone().all(|pose| (0.0..6.0).contains(&pose)) && poses.count() > 100);
    }
    server.get("/api/v1/calibrations/nowhere/residuals").expect(404);
    certified(&folder, server, &id);
}

/// A certificate needs an issuer, who is never invented; then it states the devices that captured the images.
fn certified(folder: &TempDir, server: Server, id: &str) {
    let address = format!("/api/v1/calibrations/{id}/report?format=dcc");
    let refused = server.get(&address).expect(422);
    assert!(refused["detail"].as_str().unwrap().contains("certificate.laboratory.name"), "{refused}");
    assert!(refused["remedy"].as_str().unwrap().ends_with("restart the service"), "{refused}");
    server.get(&format!("/api/v1/calibrations/{id}/report?format=pdf")).expect(400);
    server.terminate();
    let mut settings =
        vec!["certificate.station_number=INV-7".to_owned(), "certificate.responsible=A. B.".to_owned()];
    for contact in ["laboratory", "customer"] {
        settings
            .extend(["name=Works & Co", "city=Ort", "country=DE"].map(|to| format!("certificate.{contact}.{to}")));
    }
    let flags: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
    let server = Server::start(&folder.path().join("data"), &flags);
    let reply = server.get(&address);
    assert_eq!((reply.status, reply.header("content-type")), (200, Some("application/xml")));
    assert!(reply.header("content-disposition").unwrap().contains(&format!("calibration-{id}.xml")));
    let certificate = String::from_utf8(reply.body).unwrap();
    for text in ["schemaVersion=\"3.3.0\"", "Works &amp; Co", "INV-7", "simulated (twin)", id, "<si:expandedMU>"] {
        assert!(certificate.contains(text), "{text} in {certificate}");
    }
    let camera = server.get("/api/v1/devices/camera").expect(200)["identity"]["serial"].clone();
    let serial = format!("<dcc:value>{}</dcc:value>", camera.as_str().unwrap());
    assert!(certificate.contains(&serial), "{serial} in {certificate}");
}

#[test]
fn file_names_are_escaped_in_the_report() {
    const NAME: &str = "board/<img src=x onerror=alert(1)>.png";
    let folder = copy_of_small();
    edit_manifest(folder.path(), |manifest| {
        let board = manifest["poses"][0]["board"].as_str().unwrap().to_owned();
        std::fs::create_dir_all(folder.path().join("board")).unwrap();
        std::fs::rename(folder.path().join(board), folder.path().join(NAME)).unwrap();
        manifest["poses"][0]["board"] = json!(NAME);
    });
    let (_data, server) = fresh();
    let source = json!({ "kind": "capture", "capture_id": server.upload(folder.path()) });
    let id = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
    let report = server.get(&format!("/api/v1/calibrations/{id}/report"));
    let page = String::from_utf8(report.body.clone()).unwrap();
    assert!(page.contains("&lt;img src=x onerror=alert(1)&gt;"), "the name is shown");
    assert!(!page.contains("<img src=x"), "and is no markup");
    // A file opened from disk has no HTTP header: the policy is in the file as well.
    assert!(
        page.contains("<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'"),
        "{}",
        &page[..500]
    );
    assert!(report.header("content-security-policy").unwrap().contains("default-src 'none'"));
}
