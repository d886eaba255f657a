//! What the methods act on: the service, or a script in tests.

mod app_line;
mod devices;

pub use app_line::AppLine;
pub use devices::Devices;

use app::doors::{EventRecord, InspectionMessage, MachineState};
use app::events::JobEvent;
use app::health::StationHealth;
use async_trait::async_trait;
use serde::Deserialize as _;

use crate::refusal::Refusal;

/// What is known of the station.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Condition {
    /// The latest changes of its state with their numbers, oldest first: the last one is the state.
    pub changes: Vec<(u64, MachineState)>,
    /// The job that uses the station.
    pub job_id: Option<String>,
    /// The newest fault waiting for acknowledgement: what happened, and what to do.
    pub fault: Option<String>,
    /// The health of the station; `None` until it is known.
    pub health: Option<StationHealth>,
    /// Its devices.
    pub devices: Devices,
}

/// A requested inspection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StartJob {
    /// Serial number of the part.
    pub serial: String,
    /// Id, `id@version` or number of the recipe; `None`: by serial number.
    pub recipe: Option<String>,
    /// The client's ids of measurement and product, passed on as attributes of the part.
    pub attributes: Vec<(&'static str, String)>,
}

/// A recipe that may be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recipe {
    /// Its id.
    pub id: String,
    /// Its newest version.
    pub version: i64,
    /// SHA-256 of the version's content, hexadecimal.
    pub digest: String,
}

/// A finished inspection.
#[derive(Debug, Clone, PartialEq)]
pub struct Finished {
    /// The inspection.
    pub inspection: InspectionMessage,
    /// The job that made it, if known.
    pub job_id: Option<String>,
}

/// An inspection that ended without a result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unfinished {
    /// Its job.
    pub job_id: String,
    /// Serial number of the part.
    pub serial: String,
    /// Recipe and version: `bracket@7`.
    pub recipe: String,
    /// Whether it failed, rather than being cancelled or interrupted.
    pub has_failed: bool,
    /// Why, for a person.
    pub reason: String,
    /// When, ms since 1970 (UTC).
    pub at_ms: i64,
}

impl Unfinished {
    /// From the event of a job that ended; `None` for other events and other jobs.
    pub fn of(event: &EventRecord) -> Option<Self> {
        let has_failed = match event.kind.as_str() {
            "job.failed" => true,
            "job.cancelled" | "job.interrupted" => false,
            _ => return None,
        };
        let JobEvent { id, recipe, serial, message, problem, .. } = JobEvent::deserialize(&event.body).ok()?;
        let reason = problem.map(|problem| problem.detail).or(message).unwrap_or_default();
        Some(Self { job_id: id, serial: serial?, recipe: recipe?, has_failed, reason, at_ms: event.at_ms })
    }
}

/// Which results are listed; `None`: all.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ResultFilter {
    /// Of the part with this serial number.
    pub serial: Option<String>,
    /// Of this recipe.
    pub recipe: Option<String>,
    /// Of this version.
    pub version: Option<i64>,
    /// Of this job.
    pub job_id: Option<String>,
}

/// What a client can command and ask for. `user` is the user of the session.
#[async_trait]
pub trait Line: Send + Sync + 'static {
    /// Requests an inspection; returns the id of its job.
    async fn start(&self, user: &str, job: StartJob) -> Result<String, Refusal>;

    /// Cancels a job.
    async fn abort(&self, user: &str, job_id: &str) -> Result<(), Refusal>;

    /// Stops the station; only a reset leaves that.
    async fn halt(&self, user: &str) -> Result<(), Refusal>;

    /// Resets the station.
    async fn reset(&self, user: &str) -> Result<(), Refusal>;

    /// Number of the newest change of the station's state.
    fn newest_change(&self) -> u64;

    /// The recipes that may be used, by id.
    async fn recipes(&self) -> Result<Vec<Recipe>, Refusal>;

    /// A result by the id of the inspection.
    async fn result(&self, id: &str) -> Result<Finished, Refusal>;

    /// At most `limit` results after the first `skip`, newest first, and whether these are all.
    async fn results(
        &self,
        filter: &ResultFilter,
        skip: usize,
        limit: usize,
    ) -> Result<(Vec<Finished>, bool), Refusal>;
}
