//! What is published about the station: its state and its health.

pub mod presence;
pub mod topics;

use app::doors::{MachineState, now_ms, utc};
use serde::Serialize;
use serde_json::{Value, json};

use crate::connection::message::Message;
use crate::station::topics::Topics;

/// What is known of the station.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Condition {
    /// The latest changes of its state with their numbers, oldest first: the last one is the state.
    pub changes: Vec<(u64, MachineState)>,
    /// `twin`, `replay`, or `None` for real devices.
    pub simulated: Option<&'static str>,
    /// Faults waiting for acknowledgement.
    pub faults: Vec<FaultMessage>,
}

/// A fault waiting for acknowledgement.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FaultMessage {
    /// `camera`, `stage`, `laser`.
    pub device: &'static str,
    /// `disconnected`, `stalled`, `alarm`, …
    pub kind: &'static str,
    /// What happened.
    pub detail: String,
    /// What to do.
    pub remedy: String,
    /// When, ms since 1970.
    pub since_ms: i64,
}

impl Condition {
    /// Number of the last change; 0 before the first.
    pub fn newest(&self) -> u64 {
        self.changes.last().map_or(0, |(number, _)| *number)
    }
}

/// The station has entered this state; `seq` counts the states since the service started.
pub fn online(topics: &Topics, (seq, state): (u64, MachineState), simulated: Option<&str>) -> Message {
    let at_ms = now_ms();
    let message = json!({
        "schema": "sheaf-state/1",
        "online": true,
        "state": state.name(),
        "seq": seq,
        "simulated": simulated,
        "timestamp": utc(at_ms),
        "at_ms": at_ms,
    });
    retained(topics.state(), &message)
}

/// The service was shut down; without a time: the broker says so after the connection broke.
pub fn offline(topics: &Topics, at_ms: Option<i64>) -> Message {
    let mut message = json!({ "schema": "sheaf-state/1", "online": false });
    if let Some(at_ms) = at_ms {
        message["timestamp"] = json!(utc(at_ms));
        message["at_ms"] = json!(at_ms);
    }
    retained(topics.state(), &message)
}

/// The faults; `seq` counts their changes since the service started.
pub fn health(topics: &Topics, seq: u64, faults: &[FaultMessage]) -> Message {
    let at_ms = now_ms();
    let message = json!({
        "schema": "sheaf-health/1",
        "seq": seq,
        "faults": faults,
        "timestamp": utc(at_ms),
        "at_ms": at_ms,
    });
    retained(topics.health(), &message)
}

fn retained(topic: String, payload: &Value) -> Message {
    Message { retained: true, ..Message::json(topic, payload, None) }
}
