//! A calibrated server with a door of each kind, and their receivers.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::receivers::Receivers;
use crate::common::server::Server;
use crate::http::inspections::{inspected, place_ball, place_block};

const PATIENCE: Duration = Duration::from_secs(120);

/// The order of parts that the PLC triggers.
const PLC_ORDER: &str = "4700-A";

/// Number, serial number and verdict of an inspection.
pub type Outcome = (i64, String, String);

/// A part to be inspected.
#[derive(Debug, Clone)]
pub struct Part {
    /// Its serial number.
    pub serial: String,
    /// The recipe for its shape: `block` or `ball`.
    pub recipe: &'static str,
    /// Its height or diameter, mm.
    pub size_mm: f64,
}

impl Part {
    /// A block of this height.
    pub fn block(serial: &str, height_mm: f64) -> Self {
        Self { serial: serial.to_owned(), recipe: "block", size_mm: height_mm }
    }

    /// A ball of this diameter.
    pub fn ball(serial: &str, diameter_mm: f64) -> Self {
        Self { serial: serial.to_owned(), recipe: "ball", size_mm: diameter_mm }
    }

    /// Puts it on the stage.
    pub fn place(&self, server: &Server) {
        match self.recipe {
            "ball" => place_ball(server, self.size_mm),
            _ => place_block(server, self.size_mm),
        }
    }
}

/// The server and its receivers.
pub struct Plant {
    pub receivers: Receivers,
    server: Option<Server>,
    data: PathBuf,
    _folder: TempDir,
}

impl Plant {
    /// Running; `None` without Python.
    pub fn start() -> Option<Self> {
        let python = reference::python()?;
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        std::fs::create_dir(&data).unwrap();
        let receivers = Receivers::start(python, folder.path());
        std::fs::write(data.join("sheaf.toml"), receivers.configuration()).unwrap();
        let server = Server::start(&data, &[]);
        let calibration = json!({ "source": { "kind": "station" }, "n_poses": 8 });
        let calibration_id = server.result_of("/api/v1/calibrations", &calibration);
        server.put("/api/v1/calibrations/active", &json!({ "calibration_id": calibration_id })).expect(200);
        Some(Self { receivers, server: Some(server), data, _folder: folder })
    }

    /// The server.
    pub fn server(&self) -> &Server {
        self.server.as_ref().expect("it runs")
    }

    /// Publishes the first version of a recipe under this number.
    pub fn teach(&self, id: &str, number: u32, mut recipe: Value) {
        recipe["number"] = json!(number);
        let body = json!({ "id": id, "reason": "first", "recipe": recipe });
        self.server().post("/api/v1/recipes", &body).expect(201);
    }

    /// The PLC triggers the inspection of a part of an order by the number of its recipe, and reads what the API has. Returns
    /// the inspection.
    pub fn triggered(&self, number: u32, part: &Part) -> Value {
        part.place(self.server());
        let serial = &part.serial;
        let read = self.receivers.plc(&["trigger", &number.to_string(), serial, PLC_ORDER]);
        let listed = self.server().get(&format!("/api/v1/inspections?serial={serial}")).expect(200);
        let stored = listed["items"][0].clone();
        assert_eq!((&read["serial"], &read["verdict"]), (&json!(serial), &stored["verdict"]), "{read:#}");
        assert_eq!(stored["order"], PLC_ORDER);
        assert_eq!((&read["recipe"], &read["version"], &read["n"]), (&json!(number), &json!(1), &json!(1)));
        let result = &stored["results"][0];
        for (name, of) in
            [("value_mm", "value"), ("fixed_mm", "value"), ("uncertainty_mm", "expanded_uncertainty")]
        {
            let difference = read[name].as_f64().unwrap() - result[of].as_f64().unwrap();
            assert!(difference.abs() < 1e-4, "{name}: {read:#} {result:#}");
        }
        stored
    }

    /// No receiver is there, and the server is killed after each part; then the PLC reads the results.
    pub fn outage(&mut self, parts: &[Part]) {
        self.receivers.cut();
        for part in parts {
            part.place(self.server());
            inspected(self.server(), &json!({ "recipe": part.recipe, "serial": part.serial }));
            self.server.take().expect("it runs").kill();
            self.server = Some(Server::start(&self.data, &[]));
        }
        self.receivers.restore();
        for part in parts {
            assert_eq!(self.receivers.plc(&["read"])["serial"], json!(part.serial));
        }
    }

    /// Every receiver has every inspection of the API, in order, with its verdict. Returns them.
    pub fn same_everywhere(&self) -> Vec<Outcome> {
        let doors = self.settled();
        assert!(doors.as_array().unwrap().iter().all(|door| door["n_dead"] == 0), "{doors:#}");
        let listed = self.server().get("/api/v1/inspections?after_seq=0&limit=200").expect(200)["items"].clone();
        let expected: Vec<Outcome> = listed.as_array().unwrap().iter().map(outcome).collect();
        let receivers = &self.receivers;
        assert_eq!(outcomes(&receivers.web_messages()), expected, "web server");
        assert_eq!(outcomes(&receivers.broker_messages()), expected, "broker");
        assert_eq!(outcomes(&receivers.share_messages()), expected, "share");
        let n = expected.len();
        let files = ["csv", "dfq", "pdf", "tmp"].map(|extension| receivers.files(extension));
        assert_eq!(files, [n, n, n, 0]);
        let last = &listed[n - 1];
        let report = format!("/api/v1/inspections/{}/report?format=pdf", last["id"].as_str().unwrap());
        let report = self.server().get(&report);
        assert!(receivers.report(last["serial"].as_str().unwrap()) == report.body, "the report of {last:#}");
        let opcua = receivers.opcua(&["list", "", "0", "0"]);
        let text = |one: &Value, name: &str| one[name].as_str().unwrap().to_owned();
        let pair = |one: &Value| (text(one, "serial"), text(one, "verdict"));
        let seen: Vec<(String, String)> = opcua["results"].as_array().unwrap().iter().rev().map(pair).collect();
        let pairs: Vec<(String, String)> =
            expected.iter().map(|(_, serial, verdict)| (serial.clone(), verdict.clone())).collect();
        assert_eq!(seen, pairs, "OPC UA");
        expected
    }

    /// The doors once none of them is behind.
    fn settled(&self) -> Value {
        let begun = Instant::now();
        loop {
            let doors = self.server().get("/api/v1/doors").expect(200)["items"].clone();
            let is_done = |door: &Value| door["n_behind"] == 0 && door["n_waiting"] == 0;
            if doors.as_array().unwrap().iter().all(is_done) {
                return doors;
            }
            assert!(begun.elapsed() < PATIENCE, "{doors:#}");
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    /// All events of the log.
    pub fn events(&self) -> Vec<Value> {
        let mut all = Vec::new();
        let mut page = "/api/v1/events?limit=200".to_owned();
        loop {
            let list = self.server().get(&page).expect(200);
            let items = list["items"].as_array().unwrap();
            all.extend(items.iter().cloned());
            match list["next"].as_str().filter(|_| !items.is_empty()) {
                Some(next) => next.clone_into(&mut page),
                None => return all,
            }
        }
    }
}

fn outcome(inspection: &Value) -> Outcome {
    let text = |name: &str| inspection[name].as_str().unwrap().to_owned();
    (inspection["seq"].as_i64().unwrap(), text("serial"), text("verdict"))
}

/// The inspections in messages, each once; the order must be that of their numbers.
fn outcomes(messages: &[Value]) -> Vec<Outcome> {
    let mut ids = Vec::new();
    let mut all = Vec::new();
    for message in messages.iter().filter(|message| message["type"] == "inspection.finished") {
        if !ids.contains(&&message["id"]) {
            ids.push(&message["id"]);
            all.push(outcome(&message["data"]));
        }
    }
    assert!(all.is_sorted(), "{all:?}");
    all
}
