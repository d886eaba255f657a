//! What a door has tried: its position in the log, its state, and the last attempts.

use std::collections::VecDeque;
use std::time::Duration;

use parking_lot::Mutex;
use station::wall_clock::now_ms;
use store::{DoorRecord, EventRecord, SetAside};
use tokio::time::Instant;

use crate::doors::door::{Door, Undelivered};
use crate::doors::params::ATTEMPTS_KEPT;
use crate::doors::schedule::{jittered, reach_again_in};

/// State of a door.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DoorState {
    /// Everything it wants is delivered or set aside, or is being delivered.
    #[default]
    Delivering,
    /// The last attempt failed; the next one is scheduled.
    Waiting,
    /// The receiver wants no more events: nothing is sent until a user tests the door or resends something.
    Closed,
}

/// An attempt to deliver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attempt {
    /// When it ended.
    pub at_ms: i64,
    /// Number and kind of the event; `None`: a test message.
    pub event: Option<(i64, String)>,
    /// Why it failed; `None`: delivered.
    pub reason: Option<String>,
}

/// A door with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct DoorView {
    /// Its configured name.
    pub name: String,
    /// `folder`, `webhook`, `mqtt`, `modbus`, `opcua`.
    pub kind: &'static str,
    /// Where it delivers to.
    pub target: String,
    /// Whether it has a register map.
    pub has_register_map: bool,
    /// State.
    pub state: DoorState,
    /// Why the last attempt failed, unless a later one succeeded.
    pub reason: Option<String>,
    /// Time of the next attempt, if waiting.
    pub next_at_ms: Option<i64>,
    /// What is stored; `None` before its first start.
    pub record: Option<DoorRecord>,
    /// Number of events in the log that it has not passed yet, wanted or not.
    pub n_behind: i64,
    /// Deliveries set aside.
    pub set_aside: SetAside,
    /// The last attempts, newest first.
    pub attempts: Vec<Attempt>,
}

/// The attempts of a door since the start of the service.
#[derive(Debug, Default)]
pub struct Attempts(Mutex<Known>);

#[derive(Debug, Default)]
struct Known {
    seq: i64,
    state: DoorState,
    reason: Option<String>,
    /// When the next attempt may be made, and the same as wall-clock time.
    next: Option<(Instant, i64)>,
    /// Failed attempts to reach the receiver in a row.
    n_unreachable: u32,
    log: VecDeque<Attempt>,
}

impl Attempts {
    /// Number of the last event that the door has passed.
    pub fn seq(&self) -> i64 {
        self.0.lock().seq
    }

    /// The door has passed this event.
    pub fn pass(&self, seq: i64) {
        self.0.lock().seq = seq;
    }

    /// When the next attempt may be made, if not now; `None` within: only once a user asks for it.
    pub fn may_try(&self) -> Result<(), Option<Instant>> {
        let known = self.0.lock();
        match (known.state, known.next) {
            (DoorState::Closed, _) => Err(None),
            (DoorState::Waiting, Some((at, _))) if at > Instant::now() => Err(Some(at)),
            (DoorState::Delivering | DoorState::Waiting, _) => Ok(()),
        }
    }

    /// Adds an attempt to the log.
    pub fn log(&self, event: Option<&EventRecord>, outcome: &Result<(), Undelivered>) {
        let reason = outcome.as_ref().err().map(ToString::to_string);
        let event = event.map(|event| (event.seq, event.kind.clone()));
        let mut known = self.0.lock();
        known.log.truncate(ATTEMPTS_KEPT - 1);
        known.log.push_front(Attempt { at_ms: now_ms(), event, reason });
    }

    /// An attempt succeeded.
    pub fn succeeded(&self) {
        let mut known = self.0.lock();
        (known.state, known.reason, known.n_unreachable) = (DoorState::Delivering, None, 0);
    }

    /// The receiver could not be reached; the next attempt is scheduled.
    pub fn unreachable(&self, reason: &str, retry_after: Option<Duration>, seed: u64) {
        let mut known = self.0.lock();
        known.n_unreachable = known.n_unreachable.saturating_add(1);
        let delay = jittered(reach_again_in(known.n_unreachable, retry_after), seed);
        known.wait(reason, delay);
    }

    /// The receiver refused the next event, which is tried again after `delay`.
    pub fn refused(&self, reason: &str, delay: Duration) {
        let mut known = self.0.lock();
        known.n_unreachable = 0;
        known.wait(reason, delay);
    }

    /// The receiver wants no more events.
    pub fn close(&self, reason: &str) {
        let mut known = self.0.lock();
        (known.state, known.reason) = (DoorState::Closed, Some(reason.to_owned()));
    }

    /// The next attempt may be made at once.
    pub fn reopen(&self) {
        self.0.lock().state = DoorState::Delivering;
    }

    /// All that is known, with what is stored.
    pub fn view(
        &self,
        door: &dyn Door,
        record: Option<DoorRecord>,
        set_aside: SetAside,
        n_behind: i64,
    ) -> DoorView {
        let known = self.0.lock();
        DoorView {
            name: door.name().to_owned(),
            kind: door.kind(),
            target: door.target(),
            has_register_map: door.register_map().is_some(),
            state: known.state,
            reason: known.reason.clone(),
            next_at_ms: known.next.filter(|_| known.state == DoorState::Waiting).map(|(_, at_ms)| at_ms),
            record,
            n_behind: n_behind.max(0),
            set_aside,
            attempts: known.log.iter().cloned().collect(),
        }
    }
}

impl Known {
    fn wait(&mut self, reason: &str, delay: Duration) {
        (self.state, self.reason) = (DoorState::Waiting, Some(reason.to_owned()));
        let delay_ms = i64::try_from(delay.as_millis()).unwrap_or(i64::MAX);
        self.next = Some((Instant::now() + delay, now_ms().saturating_add(delay_ms)));
    }
}
