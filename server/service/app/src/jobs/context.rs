//! The context of a job: a computation has no access to the station.

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
use crate::jobs::progress::{JobReporter, Phase, ProgressFn, Step, Warnings};
use crate::recordings::Recordings;
use crate::resources::captures::Captures;

/// Interval between two attempts to take a station that is briefly busy.
const STATION_RETRY: Duration = Duration::from_millis(20);

/// The context of a computation: records, artifacts and a progress sink. A job runs on its own thread and may block.
pub struct ComputeContext {
    /// The job's id.
    pub id: String,
    /// Set when the job is to end.
    pub cancel: CancelFlag,
    /// Configuration: board, grating, folders.
    pub config: Arc<AppConfig>,
    /// Read access; the changes of a job go into [`Done::changes`](crate::jobs::Done::changes).
    pub catalogue: EventedCatalogue,
    /// Store for its results.
    pub artifacts: Arc<dyn Artifacts>,
    /// Captures as folders.
    pub captures: Captures,
    pub(super) runtime: tokio::runtime::Handle,
    pub(super) progress: ProgressFn,
    pub(super) warnings: Warnings,
}

/// The context of a station job: that of a computation, plus the station.
pub struct StationContext {
    /// The context of the computing part of the job.
    pub compute: ComputeContext,
    /// The hardware.
    pub station: StationHandle,
    /// The authority under which the job uses it.
    pub authority: Authority,
    /// The live bus that browsers follow.
    pub live: LiveBus,
    /// The recorder.
    pub recordings: Recordings,
}

impl Deref for StationContext {
    type Target = ComputeContext;

    fn deref(&self) -> &ComputeContext {
        &self.compute
    }
}

impl ComputeContext {
    /// Reports progress: fraction 0–1, phase, and a message for the operator.
    pub fn report(&self, fraction: f64, step: impl Into<Step>, message: &str) {
        (self.progress)(fraction, step.into(), message);
    }

    /// For a procedure that is the job's `phase` and fills `part` of its fraction, such as `0.0..0.6`; it ends when
    /// the job is cancelled.
    pub fn reporter(&self, phase: Phase, part: std::ops::Range<f64>) -> JobReporter {
        let (cancel, progress, warnings) = (self.cancel.clone(), self.progress.clone(), self.warnings.clone());
        JobReporter { cancel, progress, phase, part, warnings }
    }

    /// Ends the job if cancellation was requested.
    pub fn check_cancelled(&self) -> Result<(), JobEnd> {
        if self.cancel.is_cancelled() { Err(JobEnd::Cancelled) } else { Ok(()) }
    }

    /// Waits for something asynchronous from the job's thread.
    pub fn wait<F: Future>(&self, future: F) -> F::Output {
        self.runtime.block_on(future)
    }
}

impl StationContext {
    /// Takes the station; waits while a session capture or a manual motion uses it.
    ///
    /// # Errors
    /// [`JobEnd::Cancelled`] after a Stop or a cancellation, else why the station cannot be taken.
    pub fn take_station(&self, activity: &str) -> Result<StationLease, JobEnd> {
        loop {
            self.check_cancelled()?;
            let purpose =
                Purpose { job_id: self.id.clone(), activity: activity.to_owned(), epoch: self.authority.epoch };
            match self.station.lease(purpose) {
                Err(StationRefusal::Busy { .. }) => std::thread::sleep(STATION_RETRY),
                taken => return Ok(taken?),
            }
        }
    }
}
