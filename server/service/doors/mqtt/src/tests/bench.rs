//! A door that runs, and the deliveries for it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use app::doors::{Delivery, Door as _, EventRecord, InspectionMessage, MachineState, RecipeMessage, Undelivered};
use app::error::{AppError, ErrorKind};
use async_trait::async_trait;
use parking_lot::Mutex;
use serde_json::json;
use tokio::sync::{oneshot, watch};
use tokio::task::JoinHandle;

use crate::commands::{Inspect, Line, Started};
use crate::door::MqttDoor;
use crate::params::Times;
use crate::settings::Settings;
use crate::station::Condition;
use crate::tests::broker::PATIENCE;

pub fn settings(url: &str) -> Settings {
    serde_json::from_value(json!({ "name": "mes", "url": url })).unwrap()
}

/// Short enough that no test waits for long.
pub fn times() -> Times {
    Times {
        acknowledged_within: Duration::from_secs(5),
        reconnect_first: Duration::from_millis(50),
        reconnect_last: Duration::from_millis(400),
        health_interval: Duration::from_millis(500),
        goodbye_within: Duration::from_secs(2),
    }
}

/// A door whose task runs; it ends with its value, without a goodbye.
pub struct Running {
    pub door: Arc<MqttDoor>,
    pub line: Arc<ScriptedLine>,
    pub station: watch::Sender<Condition>,
    task: JoinHandle<()>,
    closing: oneshot::Sender<()>,
}

impl Running {
    pub fn start(settings: Settings) -> Self {
        Self::start_with(settings, times())
    }

    pub fn start_with(settings: Settings, times: Times) -> Self {
        let door = Arc::new(MqttDoor::new(settings, times).unwrap());
        let (closing, closed) = oneshot::channel::<()>();
        let station = watch::Sender::new(Condition {
            changes: vec![(1, MachineState::Preoperational)],
            ..Condition::default()
        });
        let line = Arc::<ScriptedLine>::default();
        let (running, watched, acting) = (door.clone(), station.subscribe(), line.clone());
        let task = tokio::spawn(async move { running.run(acting, watched, async { drop(closed.await) }).await });
        Self { door, line, station, task, closing }
    }

    /// Ends it as a shutdown of the service does.
    pub async fn close(self) {
        drop(self.closing);
        tokio::time::timeout(PATIENCE, self.task).await.unwrap().unwrap();
    }

    /// Ends it as a crash does: the socket is closed without a goodbye.
    pub async fn crash(self) {
        self.task.abort();
        self.task.await.unwrap_err();
    }

    pub async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        self.door.deliver(delivery).await
    }

    /// Tries until it is delivered, as the app does; returns the reasons of failures.
    pub async fn deliver_at_last(&self, delivery: &Delivery) -> Vec<String> {
        let begun = Instant::now();
        let mut reasons = Vec::new();
        while let Err(why) = self.deliver(delivery).await {
            assert!(matches!(why, Undelivered::Unreachable { .. }), "{why}");
            assert!(begun.elapsed() < PATIENCE, "{why}");
            reasons.push(why.to_string());
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        reasons
    }
}

/// A station that knows the recipe of every serial number but one.
#[derive(Default)]
pub struct ScriptedLine {
    pub calls: Mutex<Vec<String>>,
}

/// The serial number that no recipe matches.
pub const UNKNOWN: &str = "unknown";

#[async_trait]
impl Line for ScriptedLine {
    async fn inspect(&self, id: &str, inspect: &Inspect) -> Result<Started, AppError> {
        let serial = &inspect.part.serial;
        self.calls.lock().push(format!("{id} inspect {serial}"));
        if serial == UNKNOWN {
            return Err(AppError::new(ErrorKind::NotFound, "no recipe matches").remedy("name one"));
        }
        Ok(Started { job_id: format!("job of {serial}"), is_repeated: false })
    }

    async fn abort(&self, id: &str, command_id: &str) -> Result<(), AppError> {
        self.calls.lock().push(format!("{id} abort {command_id}"));
        Ok(())
    }

    async fn stop(&self, id: &str) -> Result<(), AppError> {
        self.calls.lock().push(format!("{id} stop"));
        Ok(())
    }
}

pub fn event(seq: i64, kind: &str) -> EventRecord {
    let (kind, subject) = (kind.to_owned(), format!("subject-{seq}"));
    EventRecord { seq, kind, subject, body: json!({ "recipe": "bracket@7" }), at_ms: 1_780_000_000_000 + seq }
}

/// A finished inspection of one part.
pub fn result(seq: i64) -> Delivery {
    let inspection = InspectionMessage {
        id: format!("inspection-{seq}"),
        seq,
        serial: format!("S{seq}"),
        order: None,
        recipe: RecipeMessage { id: "bracket".to_owned(), version: 7, digest: "ab".to_owned(), number: Some(12) },
        verdict: "not_ok".to_owned(),
        simulated: false,
        results: Vec::new(),
        scan_id: None,
        calibration_id: "calibration-1".to_owned(),
        re_evaluated_from: None,
        attributes: BTreeMap::new(),
        inspected_at: String::new(),
        inspected_at_ms: 0,
    };
    Delivery::new(event(seq, "inspection.finished"), Some(inspection))
}

/// An event with a payload of about this size.
pub fn large(seq: i64, size_bytes: usize) -> Delivery {
    let mut delivery = result(seq);
    if let Some(inspection) = &mut delivery.inspection {
        inspection.serial = "x".repeat(size_bytes);
    }
    delivery
}

/// The reason of a failure of a receiver that cannot be reached.
pub fn unreachable(outcome: Result<(), Undelivered>) -> String {
    match outcome {
        Err(Undelivered::Unreachable { reason, .. }) => reason,
        other => panic!("{other:?}"),
    }
}

/// The reason of a refused event.
pub fn refused(outcome: Result<(), Undelivered>) -> String {
    match outcome {
        Err(Undelivered::Refused(reason)) => reason,
        other => panic!("{other:?}"),
    }
}
