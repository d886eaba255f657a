//! Events on the wire.

use app::events::Event;
use serde::Serialize;
use serde_json::Value;
use store::EventRecord;
use utoipa::ToSchema;

use crate::wire::paging::DamagedRecordDto;

/// An event.
#[derive(Debug, Serialize, ToSchema)]
pub struct EventDto {
    /// Position in the log; also the id in the event stream.
    pub seq: i64,
    /// Id of the resource concerned.
    pub subject: String,
    /// Time, ms since 1970 (UTC).
    pub at_ms: i64,
    /// What happened.
    #[serde(flatten)]
    #[schema(value_type = Event)]
    pub event: StoredEvent,
}

/// An event as it was stored, also by an earlier version.
#[derive(Debug, Serialize)]
pub struct StoredEvent {
    /// What happened: `job.succeeded`.
    pub kind: String,
    /// Details.
    pub body: Value,
}

/// Events, oldest first.
#[derive(Debug, Serialize, ToSchema)]
pub struct EventListDto {
    /// The events.
    pub items: Vec<EventDto>,
    /// Damaged events in this range; absent if there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub damaged: Vec<DamagedRecordDto>,
    /// URL of the next events.
    pub next: String,
}

impl From<EventRecord> for EventDto {
    fn from(record: EventRecord) -> Self {
        let EventRecord { seq, kind, subject, body, at_ms } = record;
        Self { seq, subject, at_ms, event: StoredEvent { kind, body } }
    }
}
