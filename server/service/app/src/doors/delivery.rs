//! What a door delivers: one event, and the inspection if it announces one. Its JSON form is the same for all doors.

use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{Catalogue, EventRecord, StoreError};

use crate::resources::inspections::{InspectionMessage, utc};

/// The event that announces an inspection.
const INSPECTION_FINISHED: &str = "inspection.finished";

/// An event for one door.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// The event.
    pub event: EventRecord,
    /// The inspection that it announces.
    pub inspection: Option<InspectionMessage>,
    /// The report of the inspection as PDF, for a door that wants it ([`Door::wants_report`]).
    ///
    /// [`Door::wants_report`]: crate::doors::Door::wants_report
    pub report_pdf: Option<Vec<u8>>,
}

impl Delivery {
    /// An event with the inspection that it announces, without its report.
    pub fn new(event: EventRecord, inspection: Option<InspectionMessage>) -> Self {
        Self { event, inspection, report_pdf: None }
    }

    /// The event with what it refers to, without a report.
    ///
    /// # Errors
    /// The inspection cannot be read.
    pub async fn of(read: &dyn Catalogue, event: EventRecord) -> Result<Self, StoreError> {
        let inspection = match event.kind.as_str() {
            INSPECTION_FINISHED => Some(read.inspection(&event.subject).await?.try_into()?),
            _ => None,
        };
        Ok(Self::new(event, inspection))
    }

    /// A message that announces nothing.
    pub fn test(door: &str) -> Self {
        let event = EventRecord {
            seq: 0,
            kind: "door.test".to_owned(),
            subject: door.to_owned(),
            body: json!({}),
            at_ms: now_ms(),
        };
        Self::new(event, None)
    }

    /// Its id: the same at every attempt, and different for every event, even if a database was restored from a backup
    /// and its numbers begin again.
    pub fn id(&self) -> String {
        format!("event-{}-{}", self.event.seq, self.event.at_ms)
    }

    /// The message, as all JSON doors send it.
    pub fn message(&self) -> Value {
        let EventRecord { seq, kind, subject, body, at_ms } = &self.event;
        let mut message = json!({
            "schema": "sheaf-event/1",
            "id": self.id(),
            "seq": seq,
            "type": kind,
            "timestamp": utc(*at_ms),
            "subject": subject,
            "data": body,
        });
        if let Some(inspection) = &self.inspection {
            message["data"] = json!(inspection);
        }
        message
    }
}
