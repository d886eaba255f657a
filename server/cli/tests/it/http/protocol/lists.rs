//! Lists: paging, filters, damaged records.

use std::path::Path;

use serde_json::{Value, json};

use crate::common::server::{Server, zip_of};
use crate::common::small_capture;
use crate::http::fresh;

/// Ids of a list, newest first, page after page of `limit`.
#[track_caller]
fn ids(server: &Server, first: &str) -> Vec<String> {
    let (mut next, mut ids) = (Some(first.to_owned()), Vec::new());
    while let Some(page) = next {
        let list = server.get(&page).expect(200);
        ids.extend(list["items"].as_array().unwrap().iter().map(|item| item["id"].as_str().unwrap().to_owned()));
        next = list["next"].as_str().map(str::to_owned);
    }
    ids
}

#[test]
fn measurements_are_filtered_by_tool_and_verdict_and_scans_by_verdict_and_calibration() {
    let (_folder, server) = fresh();
    let capture_id = server.upload(&small_capture());
    let source = json!({ "kind": "capture", "capture_id": capture_id });
    let calibration_id = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
    let scan = |name: &str| {
        let source = json!({ "kind": "capture", "capture_id": capture_id, "scan": name });
        server.result_of("/api/v1/scans", &json!({ "source": source, "calibration_id": calibration_id }))
    };
    let scans = [scan("gauge"), scan("sphere")];
    let measure = |scan: &str, request: Value| {
        let made = server.post(&format!("/api/v1/scans/{scan}/measurements"), &request).expect(201);
        made["id"].as_str().unwrap().to_owned()
    };
    let plane = measure(&scans[0], json!({ "tool": "plane" }));
    // A tolerance that is certainly met, and a nominal value that the block does not have.
    let pass = measure(&scans[0], json!({ "tool": "step", "nominal_mm": 8.9, "tolerance_mm": 0.5 }));
    let fail = measure(&scans[0], json!({ "tool": "step", "nominal_mm": 10.0, "tolerance_mm": 0.5 }));
    let all = "/api/v1/measurements";
    assert_eq!(ids(&server, all), [&fail, &pass, &plane].map(String::as_str));
    assert_eq!(ids(&server, &format!("{all}?limit=1")), [&fail, &pass, &plane].map(String::as_str));
    assert_eq!(ids(&server, &format!("{all}?tool=step&limit=1")), [&fail, &pass].map(String::as_str));
    assert_eq!(ids(&server, &format!("{all}?verdict=ok")), [pass.as_str()]);
    assert_eq!(ids(&server, &format!("{all}?tool=plane&verdict=not_ok")), [""; 0]);
    server.get(&format!("{all}?tool=hammer")).expect(400);

    let newest_first = [&scans[1], &scans[0]].map(String::as_str);
    let of_it = format!("/api/v1/scans?calibration_id={calibration_id}&state=complete&limit=1");
    assert_eq!(ids(&server, &of_it), newest_first);
    assert_eq!(ids(&server, "/api/v1/scans?state=invalid"), [""; 0]);
    assert_eq!(ids(&server, "/api/v1/scans?calibration_id=another"), [""; 0]);
    server.get("/api/v1/scans?state=blue").expect(400);
}

/// Flips a bit in the one place of the database that holds `text`, as a failing disk would.
pub fn damage(data: &Path, text: &str) {
    let file = data.join("catalogue.sqlite3");
    let mut bytes = std::fs::read(&file).unwrap();
    let places: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at..].starts_with(text.as_bytes())).collect();
    let [place] = places[..] else { panic!("{text} is at {places:?}") };
    bytes[place] ^= 1;
    std::fs::write(file, bytes).unwrap();
}

#[test]
fn a_list_contains_the_good_records_and_reports_the_damaged_one() {
    let folder = tempfile::TempDir::new().unwrap();
    let data = folder.path().join("data");
    let archive = zip_of(&small_capture());
    let server = Server::start(&data, &[]);
    let upload = |name: &str| {
        let headers = [("content-type", "application/zip")];
        let made = server.send("POST", &format!("/api/v1/captures?name={name}"), &headers, &archive).expect(201);
        made["id"].as_str().unwrap().to_owned()
    };
    let [old, damaged, new] = ["first", "gauge-of-tuesday", "last"].map(upload);
    assert!(server.get("/api/v1/captures").expect(200)["damaged"].is_null());
    server.terminate();
    // Opening merges the write-ahead log into the database.
    Server::start(&data, &[]).terminate();
    // Name and origin are adjacent in the row; the name is also in the event.
    damage(&data, "gauge-of-tuesdayupload");

    let server = Server::start(&data, &[]);
    assert_eq!(ids(&server, "/api/v1/captures?limit=1"), [new.as_str(), old.as_str()]);
    let list = server.get("/api/v1/captures").expect(200);
    let named = list["damaged"].as_array().unwrap();
    assert_eq!((named.len(), &named[0]["kind"], &named[0]["id"]), (1, &json!("capture"), &json!(damaged)));
    assert!(named[0]["detail"].as_str().unwrap().contains("damaged in the database"), "{named:?}");
    assert!(named[0]["remedy"].as_str().unwrap().contains("delete it"), "{named:?}");
    // Requested by id it is an error, and the remedy works.
    server.get(&format!("/api/v1/captures/{damaged}")).expect(503);
    server.send("DELETE", &format!("/api/v1/captures/{damaged}"), &[], &[]).expect(204);
    assert!(server.get("/api/v1/captures").expect(200)["damaged"].is_null());
}
