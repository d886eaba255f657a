//! Sparkplug B, read by a host application that decodes with pysparkplug; see `tests/sparkplug.py`.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

use app::doors::{CharacteristicMessage, Delivery, MachineState, OperationalState};
use parking_lot::Mutex;
use serde_json::{Value, json};

use crate::settings::Settings;
use crate::tests::bench::{Running, result, settings, unreachable};
use crate::tests::broker::{Broker, PATIENCE};

const READY: MachineState = MachineState::Operational(OperationalState::Ready);

/// The host application; ends with its value.
struct Host {
    process: Child,
    seen: Arc<Mutex<Vec<Value>>>,
}

impl Host {
    /// Subscribed once this returns; `None` without Python.
    fn start(broker: &Broker) -> Option<Self> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/sparkplug.py");
        let mut command = Command::new(reference::python()?);
        command.arg("-Wignore").arg(script).args([&broker.port.to_string(), "plant"]);
        let mut process = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(process.stdout.take().unwrap()).lines();
        let seen = Arc::<Mutex<Vec<Value>>>::default();
        let arriving = seen.clone();
        // Ends with the process.
        std::thread::spawn(move || {
            let parse = |line: String| serde_json::from_str(&line).unwrap();
            lines.map_while(Result::ok).for_each(|line| arriving.lock().push(parse(line)));
        });
        let host = Self { process, seen };
        host.until(1, "ready");
        Some(host)
    }

    /// Waits until so many messages of a kind arrived since the last call; returns all of Sparkplug since then.
    fn until(&self, n: usize, kind: &str) -> Vec<Value> {
        let begun = Instant::now();
        loop {
            let mut seen = self.seen.lock();
            if seen.iter().filter(|one| one["kind"] == kind).count() >= n {
                return seen.drain(..).filter(|one| one["kind"] != "ready").collect();
            }
            assert!(begun.elapsed() < PATIENCE, "no {kind}: {seen:#?}");
            drop(seen);
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
    }

    /// The next message of a kind.
    fn one(&self, kind: &str) -> Value {
        self.until(1, kind).into_iter().find(|one| one["kind"] == kind).unwrap()
    }

    /// Asks the node for a birth.
    fn ask_for_birth(&mut self) {
        self.process.stdin.as_mut().unwrap().write_all(b"station\n").unwrap();
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

fn edge(broker: &Broker) -> Settings {
    Settings { sparkplug_group: Some("plant".to_owned()), ..settings(&broker.url()) }
}

/// A result with these characteristics, of which the second one is invalid.
fn measured(seq: i64, ids: &[&str]) -> Delivery {
    let mut delivery = result(seq);
    let one = |(idx, id): (usize, &&str)| CharacteristicMessage {
        id: (*id).to_owned(),
        measure: "distance".to_owned(),
        unit: "mm".to_owned(),
        nominal: Some(8.9),
        lower: Some(-0.05),
        upper: None,
        value: Some(8.912),
        expanded_uncertainty: (idx == 0).then_some(0.01),
        coverage_factor: 2.0,
        verdict: Some(if idx == 0 { "ok" } else { "invalid" }.to_owned()),
        reason: None,
        attributes: Default::default(),
    };
    let characteristics = ids.iter().enumerate().map(one).collect();
    if let Some(inspection) = &mut delivery.inspection {
        inspection.results = characteristics;
    }
    delivery
}

/// Kind, device and number of each message of Sparkplug.
fn heads(seen: &[Value]) -> Vec<(&str, Option<&str>, Option<u64>)> {
    let of = seen.iter().filter(|one| one["kind"] != "other");
    of.map(|one| (one["kind"].as_str().unwrap(), one["device"].as_str(), one["seq"].as_u64())).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_host_learns_the_station_and_every_result_with_its_values() {
    let broker = Broker::start();
    let Some(mut host) = Host::start(&broker) else { return };
    let running = Running::start(edge(&broker));
    let birth = host.one("NBIRTH");
    let metrics = &birth["metrics"];
    assert_eq!((&metrics["bdSeq"], &metrics["Node Control/Rebirth"]), (&json!(0), &json!(false)), "{birth:#}");
    assert_eq!((&metrics["State/Name"], &metrics["State/Number"]), (&json!("Preoperational"), &json!(1)));
    assert_eq!((&birth["seq"], &birth["qos"], &birth["retained"]), (&json!(0), &json!(0), &json!(false)));

    running.station.send_modify(|station| station.changes.push((2, READY)));
    let data = host.one("NDATA");
    assert_eq!(data["metrics"], json!({ "State/Name": "Operational.Ready", "State/Number": 6 }));
    for delivery in [measured(1, &["h", "w"]), measured(2, &["h", "w"]), measured(3, &["h"])] {
        running.deliver(&delivery).await.unwrap();
    }
    let seen = host.until(3, "other");
    let bracket = Some("bracket");
    let expected = [("DBIRTH", 2), ("DDATA", 3), ("DDATA", 4), ("DBIRTH", 5), ("DDATA", 6)];
    assert_eq!(heads(&seen), expected.map(|(kind, seq)| (kind, bracket, Some(seq))));
    let shown = &seen.iter().find(|one| one["kind"] == "DDATA").unwrap()["metrics"];
    let expected = json!({
        "Inspection/Seq": 1, "Inspection/Id": "inspection-1", "Inspection/Serial": "S1", "Inspection/Order": null,
        "Inspection/Recipe Version": 7, "Inspection/Verdict": "not_ok", "Inspection/Simulated": false,
        "Inspection/Re-evaluated From": null,
        "Characteristics/h/Value": 8.912, "Characteristics/h/U": 0.01, "Characteristics/h/Verdict": "ok",
        "Characteristics/h/Unit": "mm", "Characteristics/h/Lower Limit": 8.9 - 0.05, "Characteristics/h/Upper Limit": null,
        "Characteristics/w/Value": null, "Characteristics/w/U": null, "Characteristics/w/Verdict": "invalid",
        "Characteristics/w/Unit": "mm", "Characteristics/w/Lower Limit": 8.9 - 0.05, "Characteristics/w/Upper Limit": null,
    });
    assert_eq!(*shown, expected);
    let others: Vec<&Value> = seen.iter().filter(|one| one["kind"] == "other").map(|one| &one["topic"]).collect();
    assert_eq!(others, ["sheaf/station/result"; 3], "the acknowledged copies");

    host.ask_for_birth();
    let seen = host.until(1, "DBIRTH");
    assert_eq!(heads(&seen), [("NBIRTH", None, Some(0)), ("DBIRTH", bracket, Some(1))]);
    let again = &seen[0]["metrics"];
    assert_eq!((&again["bdSeq"], &again["State/Number"]), (&json!(0), &json!(6)));
    running.deliver(&measured(4, &["h"])).await.unwrap();
    let seen = host.until(1, "DDATA");
    assert_eq!(heads(&seen), [("DDATA", bracket, Some(2))]);
    let unborn = |one: &Value| one["unborn"].as_array().is_some_and(|names| !names.is_empty());
    assert!(!seen.iter().any(unborn), "{seen:#?}");
    running.close().await;
    let death = host.one("NDEATH");
    assert_eq!((&death["metrics"], &death["qos"]), (&json!({ "bdSeq": 0 }), &json!(1)));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_death_belongs_to_the_birth_of_its_connection() {
    let mut broker = Broker::start();
    let Some(mut host) = Host::start(&broker) else { return };
    let running = Running::start(edge(&broker));
    running.deliver(&measured(1, &["h"])).await.unwrap();
    host.until(1, "DDATA");
    broker.kill();
    unreachable(running.deliver(&measured(2, &["h"])).await);
    broker.start_again();
    running.deliver_at_last(&measured(2, &["h"])).await;
    // The host comes back later than the node, and asks for what it has missed.
    host.until(1, "ready");
    host.ask_for_birth();
    let birth = host.one("NBIRTH");
    let bd_seq = birth["metrics"]["bdSeq"].as_u64().unwrap();
    assert!(bd_seq > 0, "{birth:#}");
    running.crash().await;
    assert_eq!(host.one("NDEATH")["metrics"], json!({ "bdSeq": bd_seq }));
}
