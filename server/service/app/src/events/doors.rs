//! Bodies of the events of doors and their deliveries.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::initiator::Initiator;

/// A door that waits; the subject is its name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DoorWaiting {
    /// `folder`, `webhook`, `mqtt`, `modbus`, `opcua`.
    pub kind: String,
    /// Where it delivers to.
    pub target: String,
    /// Why the last attempt failed.
    pub reason: String,
}

/// A delivery that was given up; the subject is the name of the door.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeliveryDead {
    /// Number of the event.
    pub seq: i64,
    /// Its kind.
    pub kind: String,
    /// Number of failed attempts.
    pub n_attempts: i64,
    /// Why the last attempt failed.
    pub reason: String,
}

/// Deliveries changed by a user; the subject is the name of the door.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DeliveriesChanged {
    /// Who initiated it.
    #[serde(flatten)]
    pub initiator: Initiator,
    /// Numbers of the events.
    pub seqs: Vec<i64>,
}
