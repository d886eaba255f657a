//! Results of inspections at all doors at once: a share, a web server, a broker, a PLC and an OPC UA client get the same
//! ones, also after an outage of all of them in which the server is killed.

mod plant;
mod receivers;
mod walk;

use serde_json::{Value, json};

use self::plant::{Part, Plant};
use super::inspections::block_recipe;
use crate::common::server::Server;

/// What a part is made wrong by, mm; the recipes permit half of it.
const DEFECT_MM: f64 = 0.06;

/// Nominal height of the block, mm.
const HEIGHT_MM: f64 = 8.9;

#[test]
fn all_doors_deliver_every_result_across_an_outage_and_three_kills() {
    let Some(mut plant) = Plant::start() else { return };
    plant.teach("block", 12, block_recipe(DEFECT_MM / 2.0));
    for door in plant.server().get("/api/v1/doors").expect(200)["items"].as_array().unwrap() {
        assert_eq!((&door["state"], &door["n_delivered"]), (&json!("delivering"), &json!(0)), "{door:#}");
    }
    the_map_of_registers_is_offered_by_the_door_that_has_one(plant.server());

    for (serial, height_mm, verdict) in [("BL-1", HEIGHT_MM, "ok"), ("BL-2", HEIGHT_MM - DEFECT_MM, "not_ok")] {
        let stored = plant.triggered(12, &Part::block(serial, height_mm));
        assert_eq!(stored["verdict"], verdict, "{stored:#}");
    }

    // An OPC UA client starts a part, and receives the verdict that the API has.
    plant.receivers.trust_opcua_client();
    Part::block("BL-OPC", HEIGHT_MM - DEFECT_MM).place(plant.server());
    let seen = plant.receivers.opcua(&["inspect", "block", "BL-OPC"]);
    let stored = plant.server().get("/api/v1/inspections?serial=BL-OPC").expect(200)["items"][0].clone();
    let height = &stored["results"][0];
    for way in ["event", "by_id", "latest", "components"] {
        let result = &seen[way];
        assert_eq!((&result["id"], &result["job_id"]), (&stored["id"], &seen["job_id"]), "{way}: {seen:#}");
        assert_eq!((&result["verdict"], &result["verdicts"][0]), (&json!("not_ok"), &height["verdict"]), "{way}");
        let numbers = (&result["values"][0], &result["expanded_uncertainties"][0]);
        assert_eq!(numbers, (&height["value"], &height["expanded_uncertainty"]), "{way}");
    }
    assert_eq!(plant.receivers.plc(&["read"])["serial"], "BL-OPC");

    // It reads the health of the station: of the simulated devices, and of the scan that it has started.
    let health = plant.receivers.opcua(&["health"])["values"].clone();
    for owner in [".Camera", ".Stage", ".Laser"] {
        assert_eq!(health[format!("{owner}.Health.DeviceHealth")][0], json!(0), "{owner}: {health:#}");
        assert_ne!(health[format!("{owner}.Identification.Model")][0], json!(""), "{owner}: {health:#}");
    }
    assert_eq!(health[".Health.CalibrationId"][0], stored["calibration_id"], "{health:#}");
    let watched = plant.server().get("/api/v1/station/watches").expect(200);
    let newest = watched["readings"].as_array().unwrap().iter().max_by_key(|scan| scan["at_ms"].as_i64()).unwrap();
    for (path, watch) in [(".Stage.Health.LostSteps", "lost_steps"), (".Laser.Health.Wavelength", "wavelength")] {
        let of = newest["verdicts"].as_array().unwrap().iter().find(|verdict| verdict["watch"] == watch).unwrap();
        assert_eq!((&health[path][0], &health[path][2]), (&of["state"], &newest["at_ms"]), "{path}: {newest:#}");
    }

    // An MQTT client starts a part, once however often it asks.
    let command = json!({ "id": "order-5", "command": "inspect", "recipe": "block", "serial": "BL-MQTT" });
    let [accepted, repeated] = [plant.receivers.mqtt(&command), plant.receivers.mqtt(&command)];
    assert_eq!((&accepted["accepted"], &accepted["repeated"]), (&json!(true), &json!(false)), "{accepted:#}");
    assert_eq!((&repeated["job_id"], &repeated["repeated"]), (&accepted["job_id"], &json!(true)), "{repeated:#}");
    assert_eq!(plant.receivers.plc(&["read"])["serial"], "BL-MQTT");

    // An order in a file is one inspection, with the order's number.
    Part::block("BL-3", HEIGHT_MM).place(plant.server());
    plant.receivers.order(&json!({ "recipe": "block", "serial": "BL-3", "order": "4711" }));
    assert_eq!(plant.receivers.plc(&["read"])["serial"], "BL-3");
    let ordered = plant.server().get("/api/v1/inspections?order=4711").expect(200)["items"].clone();
    assert_eq!((ordered.as_array().unwrap().len(), &ordered[0]["serial"]), (1, &json!("BL-3")));

    plant.outage(&["BL-4", "BL-5", "BL-6"].map(|serial| Part::block(serial, HEIGHT_MM)));
    let expected = plant.same_everywhere();
    assert_eq!(expected.len(), 8, "{expected:?}");
    let events = plant.events();
    let waited = |door: &str| {
        let is_about = |event: &&Value| event["subject"] == door && event["kind"] == "door.waiting";
        events.iter().filter(is_about).count()
    };
    assert!(waited("mes") > 0 && waited("share") > 0 && waited("broker") > 0, "{events:#?}");
}

/// The map is that of the interface documents; doors without registers say so.
fn the_map_of_registers_is_offered_by_the_door_that_has_one(server: &Server) {
    let doors = server.get("/api/v1/doors").expect(200);
    let of_doors = doors["items"].as_array().unwrap().iter().map(|door| &door["register_map_href"]);
    let hrefs: Vec<&str> = of_doors.filter_map(Value::as_str).collect();
    assert_eq!(hrefs, ["/api/v1/doors/plc/registers"], "{doors:#}");
    let map = server.get(hrefs[0]);
    assert_eq!((map.status, map.header("content-type")), (200, Some("text/csv; charset=utf-8")));
    let published = concat!(env!("CARGO_MANIFEST_DIR"), "/../../openapi/modbus.csv");
    assert!(map.body == std::fs::read(published).unwrap(), "the served map differs from {published}");
    let refused = server.get("/api/v1/doors/mes/registers").expect(404);
    assert_eq!(refused["detail"], "the door mes has no registers, its kind is webhook", "{refused:#}");
}
