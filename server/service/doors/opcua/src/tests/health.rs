//! asyncua reads and follows the health of the station.

use std::sync::atomic::Ordering;

use serde_json::{Value, json};

use crate::tests::plant::{CALIBRATED_AT_MS, FAULT, FAULTY, Plant, SCANNED_AT_MS, answer};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_reads_the_health_of_the_station_and_of_its_devices() {
    let mut plant = Plant::new();
    let anonymous = crate::Settings { users: Vec::new(), commands: false, anonymous: true, ..plant.settings() };
    plant.start(anonymous).await;
    let Some(output) = plant.client("none", "-", "-", &["health"]).await else { return };
    let seen = answer(&output);
    assert_eq!(seen["device_set"], json!(["Camera", "DeviceFeatures", "Laser", "Stage"]));
    assert_eq!(
        seen["conditions"],
        json!(["NORMAL", "FAILURE", "CHECK_FUNCTION", "OFF_SPEC", "MAINTENANCE_REQUIRED"])
    );
    let groups = seen["groups"].as_object().unwrap();
    assert_eq!((groups.len(), groups.values().all(|is_group| *is_group == true)), (7, true), "{seen:#}");
    let value_of = |path: &str| (seen["values"][path][0].clone(), seen["values"][path][1].clone());
    for owner in ["", ".Camera", ".Stage", ".Laser"] {
        assert_eq!(value_of(&format!("{owner}.Health.DeviceHealth")), (json!(0), json!("Good")), "{owner}");
        assert_eq!(value_of(&format!("{owner}.Health.Message")), (Value::Null, json!("Good")), "{owner}");
    }
    for (path, value, status) in [
        (".Health.CalibrationId", json!("c"), "Good"),
        (".Health.CalibratedAt", json!(CALIBRATED_AT_MS), "Good"),
        (".Camera.Health.FramesLost", json!(3), "Good"),
        (".Camera.Identification.Manufacturer", json!("Maker"), "Good"),
        (".Stage.Identification.Model", json!("Slide"), "Good"),
        (".Stage.Identification.SerialNumber", json!("4711"), "Good"),
        (".Stage.Health.Homed", json!(true), "Good"),
        (".Stage.Health.LostSteps", json!("quiet"), "Good"),
        (".Stage.Health.StageScale", Value::Null, "BadNoData"),
        (".Laser.Health.Wavelength", json!("blind"), "Good"),
        (".Laser.Health.Light", Value::Null, "BadNoCommunication"),
        (".Laser.Identification.Model", Value::Null, "BadNoCommunication"),
    ] {
        assert_eq!(value_of(path), (value, json!(status)), "{path}");
    }
    assert_eq!(seen["values"][".Stage.Health.LostSteps"][2], json!(SCANNED_AT_MS));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_follows_a_device_into_a_failure_and_back() {
    let mut plant = Plant::new();
    plant.start(plant.settings()).await;
    let Some(()) = plant.introduce().await else { return };
    let Some(seen) = plant.user(&["follow-health", "bracket", FAULTY]).await else { return };
    let values = seen["values"].as_array().unwrap();
    let conditions: Vec<_> = values.iter().map(|value| value[0].clone()).collect();
    assert_eq!(conditions, [json!(0), json!(1), json!(0)], "{seen:#}");
    assert_eq!(values[1][2], json!(plant.line.failed_at_ms.load(Ordering::Relaxed)), "the time of the fault");
    assert_eq!((&seen["failed"], &seen["system"], &seen["message"]), (&json!(FAULT), &json!(1), &Value::Null));
}
