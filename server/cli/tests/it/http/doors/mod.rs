//! Results of inspections at all doors at once: a share, a web server, a broker, a PLC and an OPC UA client get the same
//! ones, also after an outage of all of them in which the server is killed.

mod receivers;

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use self::receivers::Receivers;
use super::inspections::{block_recipe, inspected, place_block};
use crate::common::server::Server;

const PATIENCE: Duration = Duration::from_secs(120);

/// What a part is made wrong by, mm; the recipe permits half of it.
const DEFECT_MM: f64 = 0.06;

/// Serial number and verdict of an inspection, by its number.
type Result = (i64, String, String);

fn result(inspection: &Value) -> Result {
    let text = |name: &str| inspection[name].as_str().unwrap().to_owned();
    (inspection["seq"].as_i64().unwrap(), text("serial"), text("verdict"))
}

/// The inspections in messages, each once; the order must be that of their numbers.
fn results(messages: &[Value]) -> Vec<Result> {
    let mut ids = Vec::new();
    let mut all = Vec::new();
    for message in messages.iter().filter(|message| message["type"] == "inspection.finished") {
        if !ids.contains(&&message["id"]) {
            ids.push(&message["id"]);
            all.push(result(&message["data"]));
        }
    }
    assert!(all.is_sorted(), "{all:?}");
    all
}

/// The doors once none of them is behind.
fn settled(server: &Server) -> Value {
    let begun = Instant::now();
    loop {
        let doors = server.get("/api/v1/doors").expect(200)["items"].clone();
        let is_done = |door: &Value| door["n_behind"] == 0 && door["n_waiting"] == 0;
        if doors.as_array().unwrap().iter().all(is_done) {
            return doors;
        }
        assert!(begun.elapsed() < PATIENCE, "{doors:#}");
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn all_doors_deliver_every_result_across_an_outage_and_three_kills() {
    let Some(python) = reference::python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    std::fs::create_dir(&data).unwrap();
    let mut receivers = Receivers::start(python, folder.path());
    std::fs::write(data.join("sheaf.toml"), receivers.configuration()).unwrap();
    let mut server = Server::start(&data, &[]);
    let calibration = json!({ "source": { "kind": "station" }, "n_poses": 8 });
    let calibration_id = server.result_of("/api/v1/calibrations", &calibration);
    server.put("/api/v1/calibrations/active", &json!({ "calibration_id": calibration_id })).expect(200);
    let mut recipe = block_recipe(DEFECT_MM / 2.0);
    recipe["number"] = json!(12);
    server.post("/api/v1/recipes", &json!({ "id": "block", "reason": "first", "recipe": recipe })).expect(201);
    for door in server.get("/api/v1/doors").expect(200)["items"].as_array().unwrap() {
        assert_eq!((&door["state"], &door["n_delivered"]), (&json!("delivering"), &json!(0)), "{door:#}");
    }

    // The PLC triggers, and reads the verdict that the API has.
    for (serial, height_mm, verdict) in [("BL-1", 8.9, "ok"), ("BL-2", 8.9 - DEFECT_MM, "not_ok")] {
        place_block(&server, height_mm);
        let read = receivers.plc(&["trigger", "12", serial]);
        let stored = server.get(&format!("/api/v1/inspections?serial={serial}")).expect(200)["items"][0].clone();
        assert_eq!((&read["serial"], &read["verdict"]), (&json!(serial), &json!(verdict)), "{read:#}");
        assert_eq!((&read["recipe"], &read["version"], &read["n"]), (&json!(12), &json!(1), &json!(1)));
        let height = &stored["results"][0];
        for (name, of) in
            [("value_mm", "value"), ("fixed_mm", "value"), ("uncertainty_mm", "expanded_uncertainty")]
        {
            let difference = read[name].as_f64().unwrap() - height[of].as_f64().unwrap();
            assert!(difference.abs() < 1e-4, "{name}: {read:#} {height:#}");
        }
    }

    // An OPC UA client starts a part, and receives the verdict that the API has.
    receivers.trust_opcua_client();
    place_block(&server, 8.9 - DEFECT_MM);
    let seen = receivers.opcua(&["inspect", "block", "BL-OPC"]);
    let stored = server.get("/api/v1/inspections?serial=BL-OPC").expect(200)["items"][0].clone();
    let height = &stored["results"][0];
    for way in ["event", "by_id", "latest"] {
        let result = &seen[way];
        assert_eq!((&result["id"], &result["job_id"]), (&stored["id"], &seen["job_id"]), "{way}: {seen:#}");
        assert_eq!((&result["verdict"], &result["verdicts"][0]), (&json!("not_ok"), &height["verdict"]), "{way}");
        let numbers = (&result["values"][0], &result["expanded_uncertainties"][0]);
        assert_eq!(numbers, (&height["value"], &height["expanded_uncertainty"]), "{way}");
    }
    assert_eq!(receivers.plc(&["read"])["serial"], "BL-OPC");

    // An order in a file is one inspection, with the order's number.
    place_block(&server, 8.9);
    receivers.order(&json!({ "recipe": "block", "serial": "BL-3", "order": "4711" }));
    assert_eq!(receivers.plc(&["read"])["serial"], "BL-3");
    let ordered = server.get("/api/v1/inspections?order=4711").expect(200)["items"].clone();
    assert_eq!((ordered.as_array().unwrap().len(), &ordered[0]["serial"]), (1, &json!("BL-3")));

    // No receiver is there, and the server is killed after each part.
    receivers.cut();
    for serial in ["BL-4", "BL-5", "BL-6"] {
        place_block(&server, 8.9);
        inspected(&server, &json!({ "recipe": "block", "serial": serial }));
        server.kill();
        server = Server::start(&data, &[]);
    }
    receivers.restore();
    for serial in ["BL-4", "BL-5", "BL-6"] {
        assert_eq!(receivers.plc(&["read"])["serial"], serial);
    }
    let doors = settled(&server);
    assert!(doors.as_array().unwrap().iter().all(|door| door["n_dead"] == 0), "{doors:#}");

    let listed = server.get("/api/v1/inspections?after_seq=0").expect(200)["items"].clone();
    let expected: Vec<Result> = listed.as_array().unwrap().iter().map(result).collect();
    assert_eq!(expected.len(), 7, "{expected:?}");
    assert_eq!(results(&receivers.web_messages()), expected, "web server");
    assert_eq!(results(&receivers.broker_messages()), expected, "broker");
    assert_eq!(results(&receivers.share_messages()), expected, "share");
    assert_eq!((receivers.files("csv"), receivers.files("dfq"), receivers.files("tmp")), (7, 7, 0));
    let opcua = receivers.opcua(&["list", "", "0", "0"]);
    let pair =
        |one: &Value| (one["serial"].as_str().unwrap().to_owned(), one["verdict"].as_str().unwrap().to_owned());
    let seen: Vec<(String, String)> = opcua["results"].as_array().unwrap().iter().rev().map(pair).collect();
    let pairs: Vec<(String, String)> =
        expected.iter().map(|(_, serial, verdict)| (serial.clone(), verdict.clone())).collect();
    assert_eq!(seen, pairs, "OPC UA");
    let events = server.get("/api/v1/events?limit=200").expect(200)["items"].clone();
    let waited = |door: &str| {
        let is_about = |event: &&Value| event["subject"] == door && event["kind"] == "door.waiting";
        events.as_array().unwrap().iter().filter(is_about).count()
    };
    assert!(waited("mes") > 0 && waited("share") > 0 && waited("broker") > 0, "{events:#}");
}
