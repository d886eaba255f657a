//! `sheaf config`: effective values and their origins.

use serde_json::json;

use crate::common::{err, sheaf, sheaf_json};

#[test]
fn every_value_is_printed_with_its_origin() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sheaf.toml"), "[target]\nsquare_mm = 7.5\n").unwrap();
    let data = folder.path().display().to_string();
    let (config, code) = sheaf_json(&["config", "--data", &data, "--set", "station.twin.seed=11"]);
    assert_eq!(code, 0);
    assert_eq!(config["target.square_mm"]["value"], 7.5);
    assert_eq!(config["target.square_mm"]["from"]["layer"], "file");
    assert_eq!(config["target.square_mm"]["from"]["line"], 2);
    assert_eq!(config["station.twin.seed"]["value"], 11);
    assert_eq!(config["data"]["from"], json!({ "layer": "flag", "name": "--data" }));
    assert_eq!(config["listen"]["from"]["layer"], "default");
}

#[test]
fn a_wrong_value_is_reported_and_prevents_the_start() {
    let output = sheaf(&["serve", "--set", "station.stage.kind=robot"]);
    assert_eq!(output.status.code(), Some(3), "{}", err(&output));
    for word in ["station.stage.kind", "robot", "twin, replay, grbl"] {
        assert!(err(&output).contains(word), "{}", err(&output));
    }
}
