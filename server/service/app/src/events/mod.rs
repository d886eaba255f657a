//! Events as stored and published: one kind per action, each with its own body.
//!
//! `openapi/events.md` lists them; it is generated from these types.

mod artifacts;
mod doors;
mod initiator;
mod inspections;
mod jobs;
mod kinds;
mod scans;
mod station;

pub use self::doors::{DeliveriesChanged, DeliveryDead, DoorWaiting};
pub use self::station::{
    CameraConfigured, CameraDarkFrameTaken, CameraFeaturesSet, ControlTakenOver, FeatureSet, LaserSwitched,
    LiveView, SimulatedFault, StageMotion, by_kind,
};
pub use artifacts::{
    Activation, CalibrationCreated, CaptureCreated, ModelCreated, RecordingEnded, RecordingStarted, SessionVersion,
};
pub use initiator::Initiator;
pub use inspections::{InspectionFinished, InspectionsHeld, RecipePublished, RuleViolated, ViolatedRule};
pub use jobs::{JobEvent, JobResult};
pub use kinds::{EmptyBody, Event};
pub use scans::{MeasurementCreated, MeasurementPlanChanged, ScanCreated, ScanExported, WatchWarned};

use ::station::wall_clock::now_ms;
use serde_json::Value;
use store::{Change, EventRecord};

/// An event about `subject` with the current time, to be appended.
pub fn event(subject: &str, event: Event) -> Change {
    Change::AppendEvent(event_record(subject, event))
}

/// An event about `subject` with the current time.
pub fn event_record(subject: &str, event: Event) -> EventRecord {
    let Ok(Value::Object(mut parts)) = serde_json::to_value(event) else {
        unreachable!("an event is a kind and a body of texts and numbers")
    };
    let kind = parts.remove("kind").and_then(|kind| kind.as_str().map(str::to_owned)).unwrap_or_default();
    let body = parts.remove("body").unwrap_or_default();
    EventRecord { seq: 0, kind, subject: subject.to_owned(), body, at_ms: now_ms() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_stored_by_kind_and_body() {
        let [principal, actor, source] = ["local", "Anna", "127.0.0.1"].map(str::to_owned);
        let initiator = Initiator { principal, actor, source };
        let Change::AppendEvent(record) =
            event("laser", Event::LaserSwitched(LaserSwitched { initiator, power: 0.5 }))
        else {
            panic!("an event is appended")
        };
        assert_eq!((record.kind.as_str(), record.subject.as_str()), ("laser.switched", "laser"));
        let body =
            serde_json::json!({ "principal": "local", "actor": "Anna", "source": "127.0.0.1", "power": 0.5 });
        assert_eq!(record.body, body);
        let Change::AppendEvent(gone) = event("7", Event::DoorRecovered(EmptyBody {})) else { panic!("appended") };
        assert_eq!((gone.kind.as_str(), gone.body), ("door.recovered", serde_json::json!({})));
    }
}
