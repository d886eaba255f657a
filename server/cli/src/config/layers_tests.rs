//! Precedence of the layers, refused values, and the defaults.

use app::config::AppConfig;

use super::*;
use crate::config::layer::FILE_NAME;

fn environment(pairs: &[(&str, &str)]) -> impl Iterator<Item = (String, String)> {
    pairs.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect::<Vec<_>>().into_iter()
}

fn with_file(text: &str, pairs: &[(&str, &str)], set: &[&str]) -> Result<Effective, ConfigError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("station.toml");
    std::fs::write(&path, text).unwrap();
    let set = set.iter().map(|text| (*text).to_owned()).collect();
    effective(&Flags { config: Some(path), set, ..Flags::default() }, environment(pairs))
}

fn origin(effective: &Effective, key: &str) -> String {
    effective.values.iter().find(|(setting, ..)| setting.key == key).unwrap().2.to_string()
}

#[test]
fn flags_override_the_environment_and_the_environment_overrides_the_file() {
    let file = "listen = \"127.0.0.1:1\"\n[station.twin]\nseed = 1\nscene = \"plate\"\nframe_rate_hz = 10\n";
    let pairs = [("SHEAF_STATION__TWIN__SEED", "2"), ("SHEAF_STATION__TWIN__SCENE", "gauge")];
    let effective = with_file(file, &pairs, &["station.twin.seed=3"]).unwrap();
    let twin = effective.config.app.station.twin.as_ref().unwrap().settings();
    assert_eq!((twin.seed, twin.scene.as_str(), twin.frame_rate_hz), (3, "gauge", 10.0));
    assert_eq!(origin(&effective, "station.twin.seed"), "flag --set");
    assert_eq!(origin(&effective, "station.twin.scene"), "environment SHEAF_STATION__TWIN__SCENE");
    assert!(origin(&effective, "station.twin.frame_rate_hz").ends_with("station.toml, line 5"));
    assert_eq!(origin(&effective, "data"), "default");
}

#[track_caller]
fn refused(result: Result<Effective, ConfigError>, words: &[&str]) {
    let text = remedy::with_remedy(&result.map(|effective| effective.config).unwrap_err());
    for word in words {
        assert!(text.contains(word), "no {word:?} in {text:?}");
    }
}

#[test]
fn errors_state_place_and_remedy() {
    refused(with_file("listen = 3", &[], &[]), &["listen cannot be integer", "line 1", "address and port"]);
    refused(with_file("\n\nlisten = ", &[], &[]), &["station.toml, line 3", "TOML"]);
    refused(with_file("[station]\nseed = 3", &[], &[]), &["\"station.seed\"", "line 2", "station.twin.seed"]);
    refused(
        with_file("listen = \"here\"", &[], &[]),
        &["listen cannot be \"here\"", "line 1", "address and port"],
    );
    refused(with_file("[station.twin]\nseed = 1.5", &[], &[]), &["station.twin.seed", "line 2", "whole number"]);
    refused(with_file("[projector]\norders = [1, 2.5]", &[], &[]), &["projector.orders", "from -100 to 100"]);
    refused(with_file("[projector]\nline_direction = \"up\"", &[], &[]), &["one of rows, columns"]);
    refused(
        with_file("[station.grbl]\nport = 3", &[], &[]),
        &["station.grbl.port cannot be integer", "serial port"],
    );
    refused(with_file("[target]\nsquare_mm = nan", &[], &[]), &["target.square_mm", "0.01 to 1000"]);
    refused(with_file("[target]\nsquare_mm = [12, 12, 12]", &[], &[]), &["target.square_mm", "or a list"]);
    let grid = "[target]\nkind = \"circles\"\ncolumns = 9\nrows = 7\nsquare_mm = 15";
    refused(
        with_file(grid, &[], &[]),
        &["target.diameter_mm cannot be", "default", "is circles", "neighbouring discs"],
    );
    let markers = ["target.kind=charuco", "target.columns=10", "target.rows=7", "target.marker_mm=9"];
    refused(with_file("", &[], &markers), &["target.dictionary", "is charuco", "DICT_4X4_50"]);
    refused(with_file("station = 3", &[], &[]), &["\"station\"", "sheaf config"]);
    let robot = with_file("", &[("SHEAF_STATION__STAGE__KIND", "robot")], &[]);
    refused(robot, &["station.stage.kind", "robot", "SHEAF_STATION__STAGE__KIND", "twin, replay, grbl"]);
    refused(with_file("", &[("SHEAF_COLOUR", "red")], &[]), &["\"colour\"", "SHEAF_COLOUR"]);
    refused(
        with_file("[station.camera]\nkind = \"replay\"\n[station.stage]\nkind = \"replay\"", &[], &[]),
        &["line 2", "station.replay.folder", "capture folder"],
    );
    refused(with_file("", &[], &["station.laser.kind=grbl"]), &["--set", "station.grbl.port", "serial port"]);
    refused(with_file("", &[], &["listen"]), &["--set KEY=VALUE"]);
    refused(with_file("", &[], &["projector.orders=1,x"]), &["projector.orders", "each a whole number"]);
}

#[test]
fn independent_lasers_are_configured_by_kind_and_number() {
    let lasers = "[projector]\nkind = \"planes\"\nlines = 2\nline_direction = \"columns\"";
    let app = with_file(lasers, &[], &[]).unwrap().config.app;
    let planes =
        capture::PlanesProjector { lines: 2, line_direction: Some("columns".to_owned()), switched: false };
    assert_eq!(app.projector, capture::Projector::Planes(planes.clone()));
    assert_eq!(app.station.twin.as_ref().unwrap().settings().lasers, Some(planes), "the twin has the same lasers");
    let one = with_file("", &[("SHEAF_PROJECTOR__LINES", "1")], &["projector.kind=planes"]).unwrap().config.app;
    assert_eq!(one.projector.orders(), [0]);
}

#[test]
fn a_projector_whose_values_do_not_fit_its_kind_is_refused_by_entry() {
    let missing = with_file("[projector]\nkind = \"planes\"", &[], &[]);
    refused(missing, &["projector.lines cannot be 0", "default", "projector.kind is planes", "1 to 41"]);
    let many = with_file("[projector]\nkind = \"planes\"\nlines = 42", &[], &[]);
    refused(many, &["projector.lines", "line 3", "0 to 41"]);
    let no_kind = with_file("[projector]\nlines = 1", &[], &[]);
    refused(no_kind, &["projector.lines cannot be 1", "line 2", "is grating", "kind = \"planes\""]);
    let twice = with_file("[projector]\norders = [0, 0]", &[], &[]);
    refused(twice, &["projector.orders cannot be [0, 0]", "line 2", "each order once"]);
    refused(with_file("[projector]\nkind = \"fan\"", &[], &[]), &["projector.kind", "line 2", "grating, planes"]);
}

#[test]
fn lines_that_cross_are_refused_with_a_remedy() {
    let remedy = ["projector.kind", "cross", "along one direction", "capture.json", "sheaf calibrate"];
    let in_file = with_file("[projector]\nkind = \"cross\"", &[], &[]);
    refused(in_file, &[&remedy[..], &["line 2"]].concat());
    refused(with_file("", &[], &["projector.kind=cross"]), &remedy);
    refused(with_file("", &[("SHEAF_PROJECTOR__KIND", "cross")], &[]), &remedy);
}

#[test]
fn station_kind_is_refused_with_the_settings_that_replace_it() {
    let in_file = with_file("[station]\nkind = \"grbl\"", &[], &[]);
    let lines =
        "[station.camera]\nkind = \"twin\"\n[station.stage]\nkind = \"grbl\"\n[station.laser]\nkind = \"grbl\"";
    refused(in_file, &["\"station.kind\"", "line 2", lines]);
    let by_flag = with_file("", &[], &["station.kind=replay"]);
    refused(by_flag, &["--set station.camera.kind=replay\n--set station.stage.kind=replay\n"]);
    let by_environment = with_file("", &[("SHEAF_STATION__KIND", "twin")], &[]);
    refused(by_environment, &["SHEAF_STATION__CAMERA__KIND=twin\n"]);
}

#[test]
fn a_replayed_camera_without_a_replayed_stage_is_refused() {
    let capture = ["station.replay.folder=capture", "station.camera.kind=replay"];
    refused(
        with_file("", &[], &capture),
        &["station.stage.kind is twin (default)", "belong together", "to replay"],
    );
}

#[test]
fn the_file_in_the_data_folder_is_read_and_must_not_set_the_data_folder() {
    let folder = tempfile::tempdir().unwrap();
    let flags = Flags { data: Some(folder.path().to_owned()), ..Flags::default() };
    std::fs::write(folder.path().join(FILE_NAME), "[target]\nsquare_mm = 7.5\n").unwrap();
    assert_eq!(effective(&flags, environment(&[])).unwrap().config.app.target.square_mm(), 7.5.into());
    std::fs::write(folder.path().join(FILE_NAME), "data = \"elsewhere\"\n").unwrap();
    refused(effective(&flags, environment(&[])), &["data folder's own file", "--data"]);
}

#[test]
fn every_kind_of_board_is_configured_with_the_entries_of_a_capture() {
    let target = |text: &str, set: &[&str]| {
        let target = with_file(&format!("[target]\n{text}"), &[], set).unwrap().config.app.target;
        serde_json::to_value(target).unwrap()
    };
    let sides = target("square_mm = 12", &["target.square_mm=12,12.1"]);
    assert_eq!(sides["square_mm"], serde_json::json!([12.0, 12.1]));
    let grid = "kind = \"asymmetric_circles\"\ncolumns = 4\nrows = 11\nsquare_mm = [10, 10.5]\ndiameter_mm = 8";
    assert_eq!(
        target(grid, &[]),
        serde_json::json!({ "kind": "asymmetric_circles", "columns": 4, "rows": 11, "square_mm": [10.0, 10.5],
            "diameter_mm": 8.0 })
    );
    let markers = "kind = \"charuco\"\ncolumns = 10\nrows = 7\nmarker_mm = 9\ndictionary = \"DICT_5X5_100\"";
    assert_eq!(
        target(markers, &[]),
        serde_json::json!({ "kind": "charuco", "columns": 10, "rows": 7, "square_mm": 12.0, "marker_mm": 9.0,
            "dictionary": "DICT_5X5_100" })
    );
}

#[test]
fn a_given_file_must_exist() {
    let flags = Flags { config: Some("/nonexistent/sheaf.toml".into()), ..Flags::default() };
    refused(effective(&flags, environment(&[])), &["/nonexistent/sheaf.toml", "--config"]);
}

#[test]
fn the_defaults_are_those_of_the_simulated_station() {
    let flags = Flags { data: Some("data".into()), ..Flags::default() };
    let config = effective(&flags, environment(&[])).unwrap().config;
    let simulated = AppConfig::simulated("data".into());
    assert_eq!((&config.app.target, &config.app.projector), (&simulated.target, &simulated.projector));
    let twin = |config: &AppConfig| config.station.twin.as_ref().unwrap().settings().clone();
    assert_eq!(twin(&config.app), twin(&simulated));
    let model = twin::StationModel::seeded(7, &twin::StationShape::default()).unwrap();
    assert_eq!(config.app.projector.orders(), model.orders);
    assert_eq!(config.app.target, twin::poses::usual_target(&model));
    assert!(config.listen.ip().is_loopback());
}

#[test]
fn every_setting_is_described_and_admits_its_default() {
    let effective = effective(&Flags::default(), environment(&[])).unwrap();
    assert!(effective.values.len() > 25, "{:?}", effective.values);
    for (setting, value, _) in &effective.values {
        assert!(!setting.about.is_empty() && setting.admits(value), "{}: {value:?}", setting.key);
    }
}

#[test]
fn an_error_in_a_door_states_list_position_and_setting() {
    let file = |text: &str| with_file(text, &[], &[]);
    let webhook = "[[doors.webhook]]\nname = \"mes\"\nurl = \"https://mes.example\"\n";
    refused(file(webhook), &["[[doors.webhook]] number 1", "line 1", "secret_file is missing"]);
    let modbus = "[[doors.modbus]]\nname = \"a\"\nlisten = \"127.0.0.1:1502\"\n";
    refused(
        file(&format!("{modbus}{modbus}write = true\n")),
        &["[[doors.modbus]] number 2", "\"write\"", "writes"],
    );
    refused(file(&format!("{modbus}{modbus}")), &["[[doors.modbus]] number 2", "two doors named \"a\""]);
    refused(file("[doors.mqtt]\nname = \"a\"\n"), &["doors.mqtt cannot be table", "[[doors.mqtt]]"]);
    let spaced = "[[doors.mqtt]]\nname = \"Hall 3\"\nurl = \"mqtt://127.0.0.1\"\n";
    refused(file(spaced), &["name", "lower-case letters"]);
    let plc = file(modbus).unwrap();
    assert_eq!(plc.config.doors.doors().unwrap().len(), 1);
}
