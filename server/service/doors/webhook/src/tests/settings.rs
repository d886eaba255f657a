//! Settings as written in a configuration.

use app::doors::{BadSetting, Door, EventRecord};
use schemars::schema_for;
use serde_json::{Value, json};
use tempfile::NamedTempFile;
use ureq::tls::RootCerts;

use super::{SECRET, open};
use crate::resolver::system_lookup;
use crate::settings::Settings;

fn minimal() -> Value {
    json!({ "name": "mes", "url": "https://mes.example/hooks", "secret_file": "mes.secret" })
}

fn with(setting: &str, value: Value) -> Result<Settings, serde_json::Error> {
    let mut settings = minimal();
    settings[setting] = value;
    serde_json::from_value(settings)
}

#[test]
fn name_url_and_secret_are_enough() {
    let settings: Settings = serde_json::from_value(minimal()).unwrap();
    let mut all = minimal();
    all["events"] = json!(["inspection.finished"]);
    all["recipes"] = json!([]);
    all["allowed_private"] = json!([]);
    all["timeout_s"] = json!(20);
    assert_eq!(serde_json::to_value(&settings).unwrap(), all);
    let door = open(settings, system_lookup, RootCerts::WebPki);
    assert_eq!((door.name(), door.kind(), &*door.target()), ("mes", "webhook", "https://mes.example/hooks"));
    assert_eq!(door.gives_up_after().unwrap().as_secs(), 24 * 3600);
    assert!(with("secret", json!(SECRET)).is_err());
}

#[test]
fn what_cannot_be_used_is_refused_by_name() {
    let secret = NamedTempFile::new().unwrap();
    std::fs::write(secret.path(), SECRET).unwrap();
    for (setting, value) in [
        ("name", json!("")),
        ("name", json!("MES")),
        ("name", json!("m e s")),
        ("url", json!("http://mes.example/")),
        ("secret_file", json!("/nowhere/mes.secret")),
        ("ca_file", json!("/nowhere/ca.pem")),
        ("ca_file", json!(secret.path())),
        ("events", json!(["Inspection"])),
        ("allowed_private", json!(["10.1.0.0/33"])),
        ("timeout_s", json!(0)),
        ("timeout_s", json!(61)),
    ] {
        let mut settings =
            Settings { secret_file: secret.path().to_owned(), ..with("name", json!("mes")).unwrap() };
        let set: Settings = with(setting, value.clone()).unwrap();
        match setting {
            "name" => settings.name = set.name,
            "url" => settings.url = set.url,
            "secret_file" => settings.secret_file = set.secret_file,
            "ca_file" => settings.ca_file = set.ca_file,
            "events" => settings.events = set.events,
            "allowed_private" => settings.allowed_private = set.allowed_private,
            _ => settings.timeout_s = set.timeout_s,
        }
        let refused = crate::open(settings).err().map(|BadSetting { setting, .. }| setting);
        assert_eq!(refused, Some(setting), "{value}");
    }
}

#[test]
fn a_door_delivers_the_events_and_recipes_chosen() {
    let settings = Settings { recipes: vec!["bracket".to_owned()], ..with("name", json!("mes")).unwrap() };
    let door = open(settings, system_lookup, RootCerts::WebPki);
    let event = |kind: &str, recipe: &str| EventRecord {
        seq: 1,
        kind: kind.to_owned(),
        subject: String::new(),
        body: json!({ "recipe": recipe }),
        at_ms: 0,
    };
    assert!(door.wants(&event("inspection.finished", "bracket@7")));
    assert!(!door.wants(&event("inspection.finished", "other@7")));
    assert!(!door.wants(&event("scan.created", "bracket@7")));
}

#[test]
fn each_setting_is_described_with_its_default_and_its_range() {
    let schema = schema_for!(Settings).to_value();
    let properties = schema["properties"].as_object().unwrap();
    assert_eq!(properties.len(), 8);
    assert!(properties.values().all(|one| one["description"].is_string()), "{schema}");
    assert_eq!(properties["timeout_s"]["default"], 20);
    assert_eq!(
        (&properties["timeout_s"]["minimum"], &properties["timeout_s"]["maximum"]),
        (&json!(1), &json!(60))
    );
    assert_eq!(schema["required"], json!(["name", "url", "secret_file"]));
}
