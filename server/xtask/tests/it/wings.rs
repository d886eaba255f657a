//! Dependencies between the crates: which crate may depend on which, and which may use the network, the database and
//! the serial port. Dependencies missing from the table are forbidden.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;

/// Crate, its folder, and the workspace crates that it may depend on. Every dependency points downwards.
const DEPENDENCIES: [(&str, &str, &[&str]); 32] = [
    (
        "sheaf",
        "server/cli",
        &[
            "sheaf-http",
            "sheaf-folder",
            "sheaf-webhook",
            "sheaf-mqtt",
            "sheaf-modbus",
            "sheaf-opcua",
            "sheaf-app",
            "sheaf-report",
            "sheaf-live",
            "sheaf-station",
            "sheaf-store",
            "sheaf-genicam",
            "sheaf-v4l2",
            "sheaf-twin",
            "sheaf-devices",
            "sheaf-pipeline",
            "sheaf-metrology",
            "sheaf-scanning",
            "sheaf-calibration",
            "sheaf-recording",
            "sheaf-capture",
            "sheaf-vision",
            "sheaf-optics",
            "sheaf-statistics",
            "sheaf-remedy",
        ],
    ),
    (
        "sheaf-http",
        "server/service/http",
        &[
            "sheaf-app",
            "sheaf-live",
            "sheaf-station",
            "sheaf-store",
            "sheaf-twin",
            "sheaf-devices",
            "sheaf-pipeline",
            "sheaf-metrology",
            "sheaf-capability",
            "sheaf-scanning",
            "sheaf-calibration",
            "sheaf-capture",
            "sheaf-vision",
            "sheaf-optics",
        ],
    ),
    ("sheaf-folder", "server/service/doors/folder", &["sheaf-app"]),
    ("sheaf-webhook", "server/service/doors/webhook", &["sheaf-app"]),
    ("sheaf-mqtt", "server/service/doors/mqtt", &["sheaf-app"]),
    ("sheaf-modbus", "server/service/doors/modbus", &["sheaf-app"]),
    ("sheaf-opcua", "server/service/doors/opcua", &["sheaf-app"]),
    (
        "sheaf-app",
        "server/service/app",
        &[
            "sheaf-report",
            "sheaf-live",
            "sheaf-station",
            "sheaf-store",
            "sheaf-twin",
            "sheaf-devices",
            "sheaf-pipeline",
            "sheaf-metrology",
            "sheaf-capability",
            "sheaf-scanning",
            "sheaf-calibration",
            "sheaf-recording",
            "sheaf-capture",
            "sheaf-vision",
            "sheaf-optics",
            "sheaf-statistics",
            "sheaf-remedy",
        ],
    ),
    (
        "sheaf-report",
        "server/service/report",
        &[
            "sheaf-pipeline",
            "sheaf-metrology",
            "sheaf-scanning",
            "sheaf-calibration",
            "sheaf-capture",
            "sheaf-vision",
            "sheaf-optics",
            "sheaf-remedy",
        ],
    ),
    ("sheaf-live", "server/service/live", &["sheaf-station", "sheaf-scanning", "sheaf-vision", "sheaf-optics"]),
    ("sheaf-store", "server/service/store", &["sheaf-remedy"]),
    ("sheaf-station", "server/hardware/station", &["sheaf-twin", "sheaf-devices", "sheaf-vision", "sheaf-remedy"]),
    (
        "sheaf-twin",
        "server/hardware/twin",
        &["sheaf-devices", "sheaf-capture", "sheaf-vision", "sheaf-optics", "sheaf-stl", "sheaf-remedy"],
    ),
    ("sheaf-genicam", "server/hardware/genicam", &["sheaf-devices", "sheaf-vision"]),
    ("sheaf-v4l2", "server/hardware/v4l2", &["sheaf-devices", "sheaf-vision"]),
    (
        "sheaf-devices",
        "server/hardware/devices",
        &["sheaf-recording", "sheaf-capture", "sheaf-vision", "sheaf-remedy"],
    ),
    (
        "sheaf-pipeline",
        "server/core/pipeline",
        &[
            "sheaf-metrology",
            "sheaf-scanning",
            "sheaf-calibration",
            "sheaf-capture",
            "sheaf-vision",
            "sheaf-optics",
            "sheaf-statistics",
            "sheaf-remedy",
        ],
    ),
    (
        "sheaf-metrology",
        "server/core/metrology",
        &[
            "sheaf-scanning",
            "sheaf-vision",
            "sheaf-optics",
            "sheaf-least-squares",
            "sheaf-statistics",
            "sheaf-remedy",
        ],
    ),
    (
        "sheaf-scanning",
        "server/core/scanning",
        &["sheaf-vision", "sheaf-optics", "sheaf-statistics", "sheaf-stl", "sheaf-remedy"],
    ),
    (
        "sheaf-calibration",
        "server/core/calibration",
        &["sheaf-vision", "sheaf-optics", "sheaf-least-squares", "sheaf-statistics", "sheaf-remedy"],
    ),
    ("sheaf-drawn", "server/drawn", &["sheaf-capture", "sheaf-vision", "sheaf-optics"]),
    ("sheaf-recording", "server/core/recording", &["sheaf-capture", "sheaf-vision", "sheaf-remedy"]),
    ("sheaf-capture", "server/core/capture", &["sheaf-vision", "sheaf-remedy"]),
    ("sheaf-vision", "server/core/vision", &["sheaf-least-squares", "sheaf-statistics", "sheaf-remedy"]),
    ("sheaf-capability", "server/core/capability", &[]),
    ("sheaf-optics", "server/core/optics", &[]),
    ("sheaf-least-squares", "server/core/least_squares", &[]),
    ("sheaf-statistics", "server/core/statistics", &[]),
    ("sheaf-stl", "server/core/stl", &["sheaf-remedy"]),
    ("sheaf-remedy", "server/core/remedy", &[]),
    ("sheaf-reference", "server/reference", &[]),
    ("xtask", "server/xtask", &[]),
];

/// Library, and the only crates that may depend on it.
const EXCLUSIVE_LIBRARIES: [(&str, &[&str]); 12] = [
    ("axum", &["sheaf-http"]),
    ("hyper", &["sheaf-http"]),
    ("utoipa-axum", &["sheaf-http"]),
    ("sqlx", &["sheaf-store"]),
    ("serialport", &["sheaf-devices"]),
    ("aravis-sys", &["sheaf-genicam"]),
    ("ureq", &["sheaf-webhook"]),
    ("rumqttc", &["sheaf-mqtt"]),
    ("tokio-modbus", &["sheaf-modbus"]),
    ("async-opcua", &["sheaf-opcua"]),
    (
        "tokio",
        &[
            "sheaf",
            "sheaf-http",
            "sheaf-folder",
            "sheaf-webhook",
            "sheaf-mqtt",
            "sheaf-modbus",
            "sheaf-opcua",
            "sheaf-app",
            "sheaf-live",
            "sheaf-store",
            "sheaf-station",
        ],
    ),
    ("clap", &["sheaf"]),
];

/// The only crates that may open sockets themselves: the HTTP server, the program that passes it its port, and the
/// servers of doors.
const NETWORK: [&str; 4] = ["sheaf-http", "sheaf-modbus", "sheaf-opcua", "sheaf"];

struct Crate {
    folder: String,
    /// Dependencies with their requested features, without dev-dependencies.
    dependencies: BTreeMap<String, Vec<String>>,
}

fn workspace() -> BTreeMap<String, Crate> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let root = metadata["workspace_root"].as_str().unwrap().to_owned();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let package = |package: &Value| {
        let manifest = text(&package["manifest_path"]);
        let folder = manifest.trim_start_matches(&root).trim_start_matches('/').trim_end_matches("/Cargo.toml");
        let is_built_with = |dependency: &&Value| dependency["kind"] != "dev";
        let features = |dependency: &Value| dependency["features"].as_array().unwrap().iter().map(text).collect();
        let all = package["dependencies"].as_array().unwrap().iter().filter(is_built_with);
        let dependencies = all.map(|one| (text(&one["name"]), features(one))).collect();
        (text(&package["name"]), Crate { folder: folder.to_owned(), dependencies })
    };
    metadata["packages"].as_array().unwrap().iter().map(package).collect()
}

#[test]
fn every_arrow_between_crates_is_in_the_table_and_runs_down() {
    let crates = workspace();
    for (name, one) in &crates {
        let row = DEPENDENCIES.iter().find(|(known, ..)| known == name);
        let (_, folder, allowed) = row.unwrap_or_else(|| panic!("{name} is not in the table of the wings"));
        assert_eq!(one.folder, *folder, "{name} is in another folder");
        for import in one.dependencies.keys().filter(|import| crates.contains_key(*import)) {
            assert!(allowed.contains(&import.as_str()), "{name} imports {import}, which the table does not allow");
        }
    }
    for (idx, (name, _, allowed)) in DEPENDENCIES.iter().enumerate() {
        assert!(crates.contains_key(*name), "the crate {name} no longer exists");
        for import in *allowed {
            let below = DEPENDENCIES[idx + 1..].iter().any(|(lower, ..)| lower == import);
            assert!(below, "the arrow from {name} to {import} does not run down the table");
        }
    }
}

#[test]
fn only_the_listed_crates_use_network_database_and_serial_port() {
    for (name, one) in &workspace() {
        for (library, users) in EXCLUSIVE_LIBRARIES {
            let knows = one.dependencies.contains_key(library);
            assert!(!knows || users.contains(&name.as_str()), "{name} must not depend on {library}");
        }
        let opens = one.dependencies.get("tokio").is_some_and(|features| features.iter().any(|one| one == "net"));
        assert!(!opens || NETWORK.contains(&name.as_str()), "{name} must not open sockets");
    }
}
