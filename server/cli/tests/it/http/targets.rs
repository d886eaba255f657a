//! A calibration session with every kind of board: captured, calibrated, and a part measured.
//!
//! Not shown here: printed boards held by hand.

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::common::server::Server;

/// Poses of the board with the stage at rest: the minimum of the page.
const POSES: usize = 8;

/// Stage positions of the stage views.
const STAGE_MM: [f64; 3] = [-20.0, 0.0, 20.0];

pub(super) struct Session {
    pub server: Server,
    pub id: String,
    _folder: TempDir,
}

impl Session {
    /// A session on a simulated station with these settings.
    #[track_caller]
    pub fn begun(settings: &[&str]) -> Self {
        let folder = TempDir::new().unwrap();
        let arguments: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
        let server = Server::start(&folder.path().join("data"), &arguments);
        let session = server.post("/api/v1/calibration-sessions", &json!({})).expect(201);
        Self { id: session["id"].as_str().unwrap().to_owned(), server, _folder: folder }
    }

    #[track_caller]
    pub fn get(&self) -> Value {
        self.server.get(&format!("/api/v1/calibration-sessions/{}", self.id)).expect(200)
    }

    #[track_caller]
    fn hold_board(&self, place: &Value) {
        self.server.put("/api/v1/simulation/board", place).expect(204);
    }

    /// Captures an image while in control.
    #[track_caller]
    fn take(&self, what: &str, body: &Value) -> Value {
        // Control is taken again for each image: on a slow machine the lease of 5 s may have expired.
        let holder = json!({ "holder": "Anna", "take_over": true });
        let control = self.server.post("/api/v1/station/control", &holder).expect(201);
        let headers = [("sheaf-control", control["id"].as_str().unwrap()), ("content-type", "application/json")];
        let url = format!("/api/v1/calibration-sessions/{}/{what}", self.id);
        let body = if body.is_null() { Vec::new() } else { body.to_string().into_bytes() };
        let session = self.server.send("POST", &url, &headers, &body).expect(200);
        self.server.send("DELETE", "/api/v1/station/control", &headers[..1], &[]).expect(204);
        session
    }

    /// Captures all images, each with all points of the board.
    #[track_caller]
    pub fn gather(&self, n_points: usize) {
        for pose in 0..POSES {
            self.hold_board(&json!({ "place": "pose", "pose": pose }));
            let session = self.take("poses", &Value::Null);
            let board = &session["body"]["poses"][pose]["board"];
            assert_eq!(board["corners"].as_array().unwrap().len(), n_points, "{}", board["problem"]);
        }
        self.hold_board(&json!({ "place": "stage" }));
        for position_mm in STAGE_MM {
            self.take("stage-views", &json!({ "position_mm": position_mm }));
        }
        self.hold_board(&json!({ "place": "away" }));
    }

    /// Calibrates and activates the result; returns the calibration.
    #[track_caller]
    pub fn solve(&self) -> Value {
        let id = self.server.result_of(&format!("/api/v1/calibration-sessions/{}/solve", self.id), &json!({}));
        self.server.get(&format!("/api/v1/calibrations/{id}")).expect(200)
    }

    /// Scans the part on the stage and measures it: value and U.
    #[track_caller]
    fn measured(&self, calibration: &Value, tool: &str) -> (f64, f64) {
        self.measured_over(8.0, calibration, tool).1
    }

    /// The same over `half_mm` of travel to both sides; also returns the id of the scan.
    #[track_caller]
    pub fn measured_over(&self, half_mm: f64, calibration: &Value, tool: &str) -> (String, (f64, f64)) {
        let scan = json!({ "source": { "kind": "station" }, "calibration_id": calibration["id"],
            "from_mm": -half_mm, "to_mm": half_mm, "step_mm": 1.0, "measure": [{ "tool": tool }] });
        let id = self.server.result_of("/api/v1/scans", &scan);
        let list = self.server.get(&format!("/api/v1/scans/{id}/measurements")).expect(200);
        let result = &list["items"][0]["result"];
        let number = |name: &str| result[name].as_f64().unwrap_or_else(|| panic!("{result:#}"));
        let measured = (number("value"), number("expanded_uncertainty"));
        (id, measured)
    }
}

/// `truth`: the true size of the simulated part, measured with `tool`.
#[track_caller]
fn check(settings: &[&str], n_points: usize, tool: &str, truth: f64) {
    let session = Session::begun(settings);
    session.gather(n_points);
    let calibration = session.solve();
    let kind = settings[0].trim_start_matches("target.kind=");
    assert_eq!(session.get()["body"]["target"]["kind"], kind);
    let (value, expanded) = session.measured(&calibration, tool);
    println!("{kind}: {tool} {value:.4} mm ± {expanded:.4} mm, true {truth} mm");
    assert!((value - truth).abs() < expanded, "{value} mm ± {expanded} mm, true {truth} mm");
}

#[test]
fn a_station_with_a_circle_grid_is_calibrated_and_measures_the_ball() {
    let settings = [
        "target.kind=circles",
        "target.columns=9",
        "target.rows=7",
        "target.square_mm=16",
        "target.diameter_mm=9",
    ];
    check(&settings, 63, "sphere", 18.9);
}

#[test]
fn a_station_with_an_asymmetric_grid_is_calibrated_and_measures_the_ball() {
    let settings = [
        "target.kind=asymmetric_circles",
        "target.columns=6",
        "target.rows=9",
        "target.square_mm=12,12.2",
        "target.diameter_mm=9",
    ];
    check(&settings, 54, "sphere", 18.9);
}

#[test]
fn a_station_with_a_charuco_board_is_calibrated_and_measures_the_block() {
    let settings = [
        "target.kind=charuco",
        "target.columns=12",
        "target.rows=9",
        "target.square_mm=12",
        "target.marker_mm=8",
        "target.dictionary=DICT_5X5_100",
        "station.twin.scene=gauge",
    ];
    check(&settings, 88, "step", 8.9);
}

#[test]
fn an_impossible_board_is_refused_with_its_setting() {
    let session = Session::begun(&[]);
    let refused = |target: Value| {
        let problem =
            session.server.post("/api/v1/calibration-sessions", &json!({ "target": target })).expect(422);
        (problem["pointer"].clone(), problem["remedy"].as_str().unwrap_or_default().to_owned())
    };
    let grid = |diameter_mm: f64| json!({ "kind": "circles", "columns": 9, "rows": 7, "square_mm": 16, "diameter_mm": diameter_mm });
    let (pointer, remedy) = refused(grid(16.0));
    assert_eq!(pointer, "/target/diameter_mm");
    assert!(remedy.contains("below the distance of neighbouring discs"), "{remedy}");
    session.server.post("/api/v1/calibration-sessions", &json!({ "target": grid(15.0) })).expect(201);
}
