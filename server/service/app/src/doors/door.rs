//! The trait of doors.

use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use store::EventRecord;

use crate::App;
use crate::doors::delivery::Delivery;
use crate::doors::params::RETRIES;

/// An interface to another system: it delivers events, and may serve requests.
#[async_trait]
pub trait Door: Send + Sync + 'static {
    /// The configured name, unique.
    fn name(&self) -> &str;

    /// `folder`, `webhook`, `mqtt`, `modbus`, `opcua`.
    fn kind(&self) -> &'static str;

    /// Where it delivers to, without secrets: an address, a topic, a folder.
    fn target(&self) -> String;

    /// Whether it delivers this event.
    fn wants(&self, event: &EventRecord) -> bool;

    /// Whether deliveries of inspections contain the report as PDF.
    fn wants_report(&self) -> bool {
        false
    }

    /// The registers of a door that is read and written by registers, as CSV for the tools of its PLC.
    fn register_map(&self) -> Option<&'static str> {
        None
    }

    /// How long after an event its delivery is given up; `None`: never.
    fn gives_up_after(&self) -> Option<Duration> {
        None
    }

    /// Times of further attempts to deliver an event that the receiver refuses, since the first one; then it is a dead
    /// letter.
    fn retries(&self) -> &[Duration] {
        &RETRIES
    }

    /// Delivers; returns once the receiver has acknowledged. It may be cancelled at any await, and the same event may
    /// be delivered again.
    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered>;

    /// Serves requests of the other system until [`App::closing`].
    async fn serve(self: Arc<Self>, _app: App) {}
}

/// Why an event was not delivered; each reason is a sentence for a user.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Undelivered {
    /// The receiver cannot be reached or is overloaded: later events would fail, too.
    #[error("{reason}")]
    Unreachable {
        /// Why.
        reason: String,
        /// Delay requested by the receiver.
        retry_after: Option<Duration>,
    },
    /// The receiver refused this event; others may pass.
    #[error("{0}")]
    Refused(String),
    /// This event can never be delivered.
    #[error("{0}")]
    Impossible(String),
    /// The receiver wants no more events: nothing is sent until a user tests the door or resends something.
    #[error("{0}")]
    Closed(String),
}

impl Undelivered {
    /// The receiver cannot be reached.
    pub fn unreachable(reason: impl Into<String>) -> Self {
        Self::Unreachable { reason: reason.into(), retry_after: None }
    }
}

/// A setting of a door that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{setting}: {why}")]
pub struct BadSetting {
    /// Its name in the table of the door.
    pub setting: &'static str,
    /// Why, and what is expected.
    pub why: String,
}
