//! Settings, good and bad.

use serde_json::{Value, json};

use crate::connection::address::Address;
use crate::open;
use crate::settings::Settings;

#[test]
fn name_and_address_suffice() {
    let settings: Settings =
        serde_json::from_value(json!({ "name": "mes", "url": "mqtt://broker.example" })).unwrap();
    assert_eq!((settings.prefix.as_str(), settings.station.as_str()), ("sheaf", "station"));
    assert_eq!((settings.events.clone(), settings.recipes.len()), (vec!["inspection.finished".to_owned()], 0));
    let door = open(settings).unwrap();
    assert_eq!((door.name(), door.kind()), ("mes", "mqtt"));
    assert_eq!(door.target(), "mqtt://broker.example:1883, topics sheaf/station/#");
}

#[test]
fn a_door_with_commands_says_so() {
    let commanded = json!({ "name": "mes", "url": "mqtt://broker.example", "commands": true });
    let door = open(serde_json::from_value(commanded).unwrap()).unwrap();
    assert!(door.target().ends_with(", commands on sheaf/station/cmd"), "{}", door.target());
}

#[test]
fn every_setting_has_a_description_and_others_are_refused() {
    let schema = schemars::schema_for!(Settings).to_value();
    let properties = schema["properties"].as_object().unwrap();
    assert_eq!(properties.len(), 11);
    for (name, property) in properties {
        assert!(property["description"].is_string(), "{name}");
    }
    let unknown = json!({ "name": "mes", "url": "mqtt://a", "topic": "b" });
    serde_json::from_value::<Settings>(unknown).unwrap_err();
}

#[test]
fn addresses_have_a_host_and_the_usual_ports() {
    let check = |url: &str, host: &str, port: u16, has_tls: bool| {
        assert_eq!(Address::parse(url).unwrap(), Address { host: host.to_owned(), port, has_tls });
    };
    check("mqtt://broker.example", "broker.example", 1883, false);
    check("mqtts://broker.example/", "broker.example", 8883, true);
    check("mqtt://10.0.0.5:1884", "10.0.0.5", 1884, false);
    check("mqtt://[::1]", "[::1]", 1883, false);
    check("mqtt://[::1]:1884", "[::1]", 1884, false);
}

#[test]
fn bad_settings_are_named() {
    let check = |setting: &str, changes: Value| {
        let mut all = json!({ "name": "mes", "url": "mqtt://broker.example" });
        all.as_object_mut().unwrap().extend(changes.as_object().unwrap().clone());
        let refused = open(serde_json::from_value(all).unwrap()).err().unwrap();
        assert_eq!(refused.setting, setting, "{refused}: {changes}");
    };
    for url in [
        "broker.example",
        "http://broker.example",
        "mqtt://",
        "mqtt://:1883",
        "mqtt://a:0",
        "mqtt://a:b",
        "mqtt://a:1883/topic",
        "mqtt://user:secret@a",
        "mqtts://[::1]",
    ] {
        check("url", json!({ "url": url }));
    }
    for prefix in ["", "/sheaf", "sheaf/", "a//b", "$SYS", "a/+", "a/#", "a\u{0}"] {
        check("prefix", json!({ "prefix": prefix }));
    }
    for station in ["", "a/b", "+", "#"] {
        check("station", json!({ "station": station }));
    }
    for group in ["", "a/b", "+", "#"] {
        check("sparkplug_group", json!({ "sparkplug_group": group }));
    }
    check("events", json!({ "events": ["Inspection"] }));
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().join("empty");
    std::fs::write(&empty, "\n").unwrap();
    check("password_file", json!({ "username": "a", "password_file": folder.path().join("missing") }));
    check("password_file", json!({ "username": "a", "password_file": empty }));
    check("password_file", json!({ "password_file": empty }));
    check("ca_file", json!({ "ca_file": empty }));
    check("ca_file", json!({ "url": "mqtts://broker.example", "ca_file": empty }));
}
