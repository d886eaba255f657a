//! What a job gets to work with: a computation never sees the station.

use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

use live::LiveBus;
use station::cancel::CancelFlag;
use station::{Purpose, StationHandle, StationLease, StationRefusal};
use store::Artifacts;

use crate::access::lease::Authority;
use crate::config::AppConfig;
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::JobEnd;
use crate::progress::{JobReporter, Phase, ProgressFn, Step};
use crate::recordings::Recordings;
use crate::resources::captures::Captures;

/// Time between two attempts to take a station that is busy for a moment.
const STATION_RETRY: Duration = Duration::from_millis(20);

/// What a computation gets to work with: records, artifacts, and a sink for its progress. A job runs on a
/// thread of its own and may block.
pub struct ComputeContext {
    /// The job's id.
    pub id: String,
    /// Set when it shall end.
    pub cancel: CancelFlag,
    /// How the station is set up: board, grating, folders.
    pub config: Arc<AppConfig>,
    /// Reads; a job's own changes go into [`Done::changes`](crate::jobs::Done::changes).
    pub ledger: EventedCatalogue,
    /// Where it puts what it makes.
    pub artifacts: Arc<dyn Artifacts>,
    /// Captures as folders.
    pub captures: Captures,
    pub(super) runtime: tokio::runtime::Handle,
    pub(super) progress: ProgressFn,
}

/// What a job at the station gets: all that a computation gets, and the station.
pub struct StationContext {
    /// For the part of the job that only computes.
    pub compute: ComputeContext,
    /// The hardware.
    pub station: StationHandle,
    /// On whose word the job uses it.
    pub authority: Authority,
    /// What browsers see while it runs.
    pub live: LiveBus,
    /// What is recorded of it.
    pub recordings: Recordings,
}

impl Deref for StationContext {
    type Target = ComputeContext;

    fn deref(&self) -> &ComputeContext {
        &self.compute
    }
}

impl ComputeContext {
    /// Says where the job is: 0–1, by name, and in the operator's words.
    pub fn report(&self, fraction: f64, step: impl Into<Step>, message: &str) {
        (self.progress)(fraction, step.into(), message);
    }

    /// For a procedure that is the job's `phase` and fills `part` of its fraction, such as `0.0..0.6`; it ends when
    /// the job is cancelled.
    pub fn reporter(&self, phase: Phase, part: std::ops::Range<f64>) -> JobReporter {
        JobReporter { cancel: self.cancel.clone(), progress: self.progress.clone(), phase, part }
    }

    /// Ends the job if that was asked for.
    pub fn go_on(&self) -> Result<(), JobEnd> {
        if self.cancel.is_cancelled() { Err(JobEnd::Cancelled) } else { Ok(()) }
    }

    /// Waits for something asynchronous from the job's thread.
    pub fn wait<F: Future>(&self, future: F) -> F::Output {
        self.runtime.block_on(future)
    }
}

impl StationContext {
    /// Takes the station; waits while a session's photograph or a motion by hand has it.
    ///
    /// # Errors
    /// [`JobEnd::Cancelled`] after a Stop or a cancellation, else why the station cannot be had.
    pub fn take_station(&self, activity: &str) -> Result<StationLease, JobEnd> {
        loop {
            self.go_on()?;
            let purpose =
                Purpose { job_id: self.id.clone(), activity: activity.to_owned(), epoch: self.authority.epoch };
            match self.station.lease(purpose) {
                Err(StationRefusal::Busy { .. }) => std::thread::sleep(STATION_RETRY),
                taken => return Ok(taken?),
            }
        }
    }
}
