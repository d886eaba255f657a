//! Studies of the station: an acceptance test from scans, a gauge R&R study from inspections. That their figures are right is
//! the matter of `metrology` and `capability`.

use serde_json::{Value, json};

use crate::common::server::Server;

const STUDIES: &str = "/api/v1/studies";

/// The scan of the inspected block on its table is a position of a plate; a second one needs another scan.
pub fn accepted(server: &Server, inspection: &Value) {
    let plate =
        json!({ "artefact": "table", "form_mm": 0.001, "mpe_flatness_mm": 0.5, "mpe_flatness_d95_mm": 0.0001 });
    let plan = json!({ "acceptance": { "plate": plate } });
    let created = server.post(STUDIES, &json!({ "name": "table & co", "plan": plan })).expect(201);
    assert_eq!(
        (&created["verdict"], &created["plan"]["acceptance"]["plate"]["form_mm"]),
        (&Value::Null, &json!(0.001))
    );
    let href = format!("{STUDIES}/{}", created["id"].as_str().unwrap());
    let positions = format!("{href}/positions");
    let scan = &inspection["scan_id"];
    let position = json!({ "procedure": "plate", "scan_id": scan, "temperature_c": 21.5 });

    let refused = |body: Value, status: u16, place: &str| {
        let problem = server.post(&positions, &body).expect(status);
        assert_eq!(problem["pointer"], place, "{problem}");
        assert!(problem["remedy"].is_string(), "{problem}");
    };
    refused(json!({ "procedure": "sphere", "scan_id": scan }), 422, "/procedure");
    refused(json!({ "procedure": "plate", "scan_id": "none" }), 422, "/scan_id");
    refused(json!({ "procedure": "plate", "scan_id": scan, "temperature_c": 68.0 }), 422, "/temperature_c");
    refused(json!({ "procedure": "plate", "scan_id": scan, "reference_mm": 1.0 }), 422, "/reference_mm");
    let study = server.post(&positions, &position).expect(201);
    refused(position, 409, "/scan_id");

    let missing = json!([{ "procedure": "plate", "n_present": 1, "n_needed": 6 }]);
    assert_eq!((&study["missing_positions"], &study["verdict"]), (&missing, &Value::Null));
    let feature = &study["positions"][0]["features"][0];
    let n_points = feature["n_points"].as_u64().unwrap();
    assert_eq!(feature["n_rejected"].as_u64().unwrap(), n_points * 3 / 1000, "{feature}");
    // A table without form shows the noise of the station: more than nothing, and far less than the height of the block.
    let [range_mm, d95_mm] = ["range_mm", "d95_mm"].map(|name| feature[name].as_f64().unwrap());
    assert!(n_points > 1000 && range_mm > d95_mm && d95_mm > 0.001 && d95_mm < 0.5, "{feature}");
    println!("table: {n_points} points, range {range_mm} mm, D95 {d95_mm} mm");
    assert_eq!(study["acceptance"]["quantities"][0]["worst_mm"], feature["range_mm"]);
    assert_eq!(&server.get(&href).expect(200)["positions"][0]["scan_id"], scan);
    assert_eq!(server.get(STUDIES).expect(200)["items"][0]["kind"], "acceptance");

    let page = server.get(&format!("{href}/report"));
    assert_eq!((page.status, page.header("content-type")), (200, Some("text/html; charset=utf-8")));
    let page = String::from_utf8(page.body).unwrap();
    for text in ["NOT COMPLETE", "table &amp; co", "Plate: 1 of 6 positions", "flatness error F", "21.5"] {
        assert!(page.contains(text), "{text}: {page}");
    }
    let document = server.get(&format!("{href}/report?format=pdf"));
    assert_eq!((document.status, document.header("content-type")), (200, Some("application/pdf")));
    assert!(document.body.starts_with(b"%PDF-"));
    assert_eq!(server.send("DELETE", &href, &[], &[]).status, 204);
    server.get(&href).expect(404);
}

/// A study of parts that are inspected from now on; returns its address.
pub fn begun(server: &Server) -> String {
    let create = |characteristic: &str, parts: Value| {
        let plan = json!({ "recipe": "block", "version": 1, "characteristic": characteristic, "parts": parts, "n_trials": 2 });
        server.post(STUDIES, &json!({ "name": "height", "plan": { "gauge_rr": plan } }))
    };
    assert_eq!(create("height", json!(["BL-5"])).expect(422)["pointer"], "/gauge_rr/parts");
    create("width", json!(["BL-5", "BL-6"])).expect(422);
    let neither = server.post(STUDIES, &json!({ "name": "neither", "plan": {} })).expect(422);
    assert_eq!(neither["pointer"], "/plan");
    let study = create("height", json!(["BL-5", "BL-6"])).expect(201);
    assert_eq!(study["missing_inspections"].as_array().unwrap().len(), 2);
    format!("{STUDIES}/{}", study["id"].as_str().unwrap())
}

/// The inspection of one of its parts since then belongs to it.
pub fn counted(server: &Server, href: &str) {
    let study = server.get(href).expect(200);
    let present: Vec<_> = study["missing_inspections"]
        .as_array()
        .unwrap()
        .iter()
        .map(|missing| (missing["serial"].as_str().unwrap(), missing["n_present"].as_u64().unwrap()))
        .collect();
    assert_eq!(present, [("BL-5", 1), ("BL-6", 0)], "{study:#}");
    assert_eq!((study["readings"].as_array().unwrap().len(), &study["verdict"]), (1, &Value::Null));
    let page = String::from_utf8(server.get(&format!("{href}/report")).body).unwrap();
    assert!(page.contains("Part BL-5: 1 of 2 inspections") && page.contains("AIAG"), "{page}");
}
