//! Doors to other systems, and their deliveries, on the wire.

use app::doors::{Attempt, DoorState, DoorView};
use serde::{Deserialize, Serialize};
use store::{DeliveryRecord, DeliveryState};
use utoipa::{IntoParams, ToSchema};

use crate::wire::events::EventDto;

/// State of a door.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DoorStateDto {
    /// Everything that the door wants is delivered or set aside, or is being delivered.
    Delivering,
    /// The last attempt failed; the next one is scheduled.
    Waiting,
    /// The receiver wants no more events: nothing is sent until the door is tested or something is resent.
    Closed,
}

/// A door: an interface that delivers events to another system.
#[derive(Debug, Serialize, ToSchema)]
pub struct DoorDto {
    /// Its configured name.
    pub name: String,
    /// `folder`, `webhook`, `mqtt`, `modbus`, `opcua`.
    pub kind: &'static str,
    /// Where it delivers to.
    pub target: String,
    /// The registers that its PLC reads and writes, as CSV; absent for doors without registers.
    pub register_map_href: Option<String>,
    /// State.
    pub state: DoorStateDto,
    /// Why the last attempt failed; absent once a later one succeeded.
    pub reason: Option<String>,
    /// Time of the next attempt, ms since 1970 (UTC), if waiting.
    pub next_at_ms: Option<i64>,
    /// Number of events in the log that it has not passed yet, whether it wants them or not.
    pub n_behind: i64,
    /// Number of delivered events.
    pub n_delivered: i64,
    /// Number of deliveries that were set aside and will be tried again.
    pub n_waiting: i64,
    /// Number of dead letters: deliveries that were given up.
    pub n_dead: i64,
    /// The last delivered event.
    pub delivered_seq: Option<i64>,
    /// Time of its delivery, ms since 1970 (UTC).
    pub delivered_at_ms: Option<i64>,
    /// The last attempts, newest first, since the start of the server; at most 100.
    pub attempts: Vec<AttemptDto>,
}

/// An attempt to deliver.
#[derive(Debug, Serialize, ToSchema)]
pub struct AttemptDto {
    /// Time, ms since 1970 (UTC).
    pub at_ms: i64,
    /// Number of the event; absent for a test message.
    pub seq: Option<i64>,
    /// Kind of the event; absent for a test message.
    pub kind: Option<String>,
    /// Why it failed; absent if it was delivered.
    pub reason: Option<String>,
}

/// All doors.
#[derive(Debug, Serialize, ToSchema)]
pub struct DoorListDto {
    /// The doors, as configured.
    pub items: Vec<DoorDto>,
}

/// State of a delivery that was set aside.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DeliveryStateDto {
    /// It is tried again.
    Waiting,
    /// It was given up: a dead letter, until a user resends or deletes it.
    Dead,
}

/// A delivery that was set aside so that later events pass.
#[derive(Debug, Serialize, ToSchema)]
pub struct DeliveryDto {
    /// The event.
    pub event: EventDto,
    /// State.
    pub state: DeliveryStateDto,
    /// Number of failed attempts.
    pub n_attempts: i64,
    /// Time of the next attempt, ms since 1970 (UTC), if waiting.
    pub next_at_ms: Option<i64>,
    /// Why the last attempt failed.
    pub reason: String,
}

/// Selects deliveries, oldest first.
#[derive(Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct DeliveriesQuery {
    /// Only those in this state.
    #[param(inline)]
    pub state: Option<DeliveryStateDto>,
    /// Only those of events after this number.
    pub after_seq: Option<i64>,
    /// Records per page, 1 to 200; default 50.
    #[param(minimum = 1, maximum = 200)]
    pub limit: Option<u32>,
}

/// Events that are delivered again.
#[derive(Debug, Serialize, ToSchema)]
pub struct ResentDto {
    /// Their numbers.
    pub seqs: Vec<i64>,
}

impl From<DoorState> for DoorStateDto {
    fn from(state: DoorState) -> Self {
        match state {
            DoorState::Delivering => Self::Delivering,
            DoorState::Waiting => Self::Waiting,
            DoorState::Closed => Self::Closed,
        }
    }
}

impl From<DoorView> for DoorDto {
    fn from(view: DoorView) -> Self {
        let record = view.record;
        Self {
            register_map_href: view.has_register_map.then(|| format!("/api/v1/doors/{}/registers", view.name)),
            name: view.name,
            kind: view.kind,
            target: view.target,
            state: view.state.into(),
            reason: view.reason,
            next_at_ms: view.next_at_ms,
            n_behind: view.n_behind,
            n_delivered: record.as_ref().map_or(0, |record| record.n_delivered),
            n_waiting: view.set_aside.n_waiting,
            n_dead: view.set_aside.n_dead,
            delivered_seq: record.as_ref().and_then(|record| record.delivered_seq),
            delivered_at_ms: record.as_ref().and_then(|record| record.delivered_at_ms),
            attempts: view.attempts.into_iter().map(AttemptDto::from).collect(),
        }
    }
}

impl From<Attempt> for AttemptDto {
    fn from(attempt: Attempt) -> Self {
        let (seq, kind) = attempt.event.unzip();
        Self { at_ms: attempt.at_ms, seq, kind, reason: attempt.reason }
    }
}

impl From<DeliveryStateDto> for DeliveryState {
    fn from(state: DeliveryStateDto) -> Self {
        match state {
            DeliveryStateDto::Waiting => Self::Waiting,
            DeliveryStateDto::Dead => Self::Dead,
        }
    }
}

impl From<DeliveryRecord> for DeliveryDto {
    fn from(record: DeliveryRecord) -> Self {
        let (state, next_at_ms) = match record.state {
            DeliveryState::Waiting => (DeliveryStateDto::Waiting, Some(record.next_at_ms)),
            DeliveryState::Dead => (DeliveryStateDto::Dead, None),
        };
        Self {
            event: record.event.into(),
            state,
            n_attempts: record.n_attempts,
            next_at_ms,
            reason: record.reason,
        }
    }
}
