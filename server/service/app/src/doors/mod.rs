//! Doors: interfaces that deliver events to other systems, at least once and in order.
//!
//! The event log is the outbox: an event is stored in the transaction that caused it. Each door has a task that reads
//! the log from the stored position of the door, delivers what the door wants, and stores the new position once the
//! receiver has acknowledged (`delivering.rs`). Nothing is pruned from the log before every configured door has passed
//! it. What a receiver refuses is set aside and tried again on its own; finally it is a dead letter that a user resends
//! or deletes. Delivery never delays a scan or an inspection.

mod attempts;
mod delivering;
mod delivery;
mod door;
mod filter;
mod params;
mod schedule;
#[cfg(test)]
mod tests;

pub use attempts::{Attempt, DoorState, DoorView};
pub use delivery::Delivery;
pub use devices::DeviceIdentity;
pub use door::{BadSetting, Door, Undelivered};
pub use filter::EventFilter;
pub use params::EVENTS_KEPT_FOR_DOORS;
pub use station::wall_clock::now_ms;
pub use station::{LaserLight, MachineState, OperationalState, StationStatus};
pub use store::{Change, EventRecord, IdempotencyRecord, InspectionFilter, Page, RecipeFilter};

pub use crate::resources::inspections::{CharacteristicMessage, InspectionMessage, RecipeMessage, utc};

use std::sync::Arc;

use store::{Artifacts, DeliveryFilter, DeliveryRecord, DeliveryState, Listed};
use tokio::sync::Notify;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use crate::App;
use crate::doors::attempts::Attempts;
use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;

/// All configured doors.
#[derive(Clone)]
pub struct Doors {
    catalogue: EventedCatalogue,
    open: Arc<Vec<Arc<OpenDoor>>>,
}

/// A door with what is known of its deliveries.
struct OpenDoor {
    door: Arc<dyn Door>,
    attempts: Attempts,
    /// Wakes the task: something is to be tried now.
    wake: Notify,
}

impl Doors {
    /// The doors, not yet delivering.
    pub fn new(catalogue: EventedCatalogue, doors: Vec<Arc<dyn Door>>) -> Self {
        let open = |door| Arc::new(OpenDoor { door, attempts: Attempts::default(), wake: Notify::new() });
        Self { catalogue, open: Arc::new(doors.into_iter().map(open).collect()) }
    }

    /// Starts delivering, and the servers of doors that have one.
    pub fn start(&self, app: &App) -> Vec<JoinHandle<()>> {
        let mut tasks = self.start_delivering(&app.artifacts, &app.closing);
        tasks.extend(self.open.iter().map(|open| tokio::spawn(open.door.clone().serve(app.clone()))));
        tasks
    }

    fn start_delivering(
        &self,
        artifacts: &Arc<dyn Artifacts>,
        closing: &CancellationToken,
    ) -> Vec<JoinHandle<()>> {
        let task = |open: &Arc<OpenDoor>| {
            let (catalogue, artifacts) = (self.catalogue.clone(), artifacts.clone());
            tokio::spawn(delivering::run(open.clone(), catalogue, artifacts, closing.clone()))
        };
        self.open.iter().map(task).collect()
    }

    /// All doors with their state.
    ///
    /// # Errors
    /// The store cannot be read.
    pub async fn list(&self) -> Result<Vec<DoorView>, AppError> {
        let mut views = Vec::new();
        for open in self.open.iter() {
            views.push(self.view(open).await?);
        }
        Ok(views)
    }

    /// One door.
    ///
    /// # Errors
    /// It is not configured, or the store cannot be read.
    pub async fn get(&self, name: &str) -> Result<DoorView, AppError> {
        self.view(self.find(name)?).await
    }

    /// The register map of a door, as CSV.
    ///
    /// # Errors
    /// The door is not configured, or has no registers.
    pub fn register_map(&self, name: &str) -> Result<&'static str, AppError> {
        let door = &self.find(name)?.door;
        door.register_map().ok_or_else(|| {
            AppError::new(
                ErrorKind::NotFound,
                format!("the door {name} has no registers, its kind is {}", door.kind()),
            )
            .remedy("use the name of a Modbus door; GET /api/v1/doors lists the doors with their kinds")
        })
    }

    async fn view(&self, open: &OpenDoor) -> Result<DoorView, AppError> {
        let read = self.catalogue.read();
        let name = open.door.name();
        let (record, set_aside) = (read.door(name).await?, read.set_aside(name).await?);
        let n_behind = read.last_event_seq().await? - open.attempts.seq();
        Ok(open.attempts.view(&*open.door, record, set_aside, n_behind))
    }

    /// Deliveries that a door has set aside, oldest first.
    ///
    /// # Errors
    /// It is not configured, or the store cannot be read.
    pub async fn deliveries(
        &self,
        name: &str,
        state: Option<DeliveryState>,
        after_seq: i64,
        limit: u32,
    ) -> Result<Listed<DeliveryRecord>, AppError> {
        self.find(name)?;
        let filter = DeliveryFilter { door: name.to_owned(), state, due_at_ms: None };
        Ok(self.catalogue.read().deliveries(&filter, after_seq, limit).await?)
    }

    /// Sends a test message now, past everything that waits.
    ///
    /// # Errors
    /// It is not configured, or it was not delivered.
    pub async fn test(&self, name: &str) -> Result<(), AppError> {
        let open = self.find(name)?;
        let outcome = open.door.deliver(&Delivery::test(name)).await;
        open.attempts.log(None, &outcome);
        outcome.map_err(|undelivered| {
            AppError::new(ErrorKind::Unavailable, format!("the test message was not delivered to {name}"))
                .because(undelivered.to_string())
                .remedy("check the address and the receiver")
        })?;
        // A receiver that works again need not wait for the next attempt.
        open.attempts.reopen();
        open.wake.notify_one();
        Ok(())
    }

    /// Changes what a door has set aside, then tries what is due.
    pub(crate) async fn change(&self, name: &str, changes: Vec<Change>) -> Result<(), AppError> {
        let open = self.find(name)?;
        self.catalogue.commit(changes).await?;
        open.attempts.reopen();
        open.wake.notify_one();
        Ok(())
    }

    /// Number of the event that every door has passed; `None` without doors.
    pub fn passed_by_all(&self) -> Option<i64> {
        self.open.iter().map(|open| open.attempts.seq()).min()
    }

    /// Whether a door of this name is configured.
    pub fn has(&self, name: &str) -> bool {
        self.find(name).is_ok()
    }

    fn find(&self, name: &str) -> Result<&Arc<OpenDoor>, AppError> {
        self.open.iter().find(|open| open.door.name() == name).ok_or_else(|| {
            AppError::new(ErrorKind::NotFound, format!("there is no door {name}"))
                .remedy("list the doors with GET /api/v1/doors")
        })
    }
}
