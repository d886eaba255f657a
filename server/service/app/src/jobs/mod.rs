//! Jobs: long operations that outlive the client that requested them and end in a defined state.
//!
//! A job is accepted durably, waits in a queue, runs on its own thread, and ends together with its results in one
//! transaction. A [`StationJob`] needs the station; a [`ComputeJob`] is a function of records and artifacts. At most
//! one job of each of the two types runs at a time.

pub mod calibrate;
mod check;
mod context;
mod end;
pub mod export;
pub mod input;
pub mod inspect;
pub mod plan;
pub mod progress;
mod queue;
pub mod scan;
mod split;
#[cfg(test)]
mod tests;
pub mod verify;

pub use context::{ComputeContext, StationContext};
pub use end::{Done, JobEnd};
pub use queue::news::JobNews;
pub use split::{ComputeJob, Job, RecordedFrames, StationJob};

pub use crate::config::limits::FREE_FLOOR_BYTES;
pub use crate::resources::scan_run::{ScanMode, ScanSource};
pub use input::{
    CalibrateInput, ExportInput, InspectInput, JobInput, ReEvaluateInput, RecomputeInput, ScanInput, Source,
    VerifyInput,
};
pub use queue::hold::InspectionHold;
pub use queue::lane::Waiting;

use crate::events::{Event, JobEvent, event};
use std::sync::Arc;

use store::{Artifacts, Change, JobRecord, JobState, Listed, StoreError};
use tokio::sync::watch;

use crate::access::lease::{Authority, ControlDesk};
use crate::config::AppConfig;
use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::progress::Step;
use crate::jobs::queue::hold::stored_hold;
use crate::jobs::queue::params::{QUEUE_LIMIT, RETRY_AFTER_S};
use crate::jobs::queue::run::Procedure;
use crate::jobs::queue::runner::{End, job_event};
use crate::recordings::Recordings;
use crate::resources::captures::Captures;
use live::LiveBus;
use queue::{Queue, run};
use station::wall_clock::now_ms;
use station::{StationHandle, StationRefusal};

/// A job as clients see it: the record with its current progress.
#[derive(Debug, Clone)]
pub struct JobView {
    /// The stored record, with current progress and message.
    pub record: JobRecord,
    /// Current step; `None` unless it is running.
    pub step: Option<Step>,
    /// Seconds to its end; `None` if unknown.
    pub remaining_s: Option<f64>,
}

impl From<JobRecord> for JobView {
    fn from(record: JobRecord) -> Self {
        Self { record, step: None, remaining_s: None }
    }
}

/// What jobs work with.
#[derive(Clone)]
pub struct JobParts {
    /// Configuration.
    pub config: Arc<AppConfig>,
    /// The catalogue and its events.
    pub catalogue: EventedCatalogue,
    /// The artifact store.
    pub artifacts: Arc<dyn Artifacts>,
    /// Captures as folders.
    pub captures: Captures,
    /// The hardware.
    pub station: StationHandle,
    /// Who is in control.
    pub control: ControlDesk,
    /// The live bus.
    pub live: LiveBus,
    /// The recorder.
    pub recordings: Recordings,
    /// Bytes free on the disk of the data directory.
    pub free_bytes: Arc<dyn Fn() -> u64 + Send + Sync>,
}

/// The queue and its runners.
#[derive(Clone)]
pub struct Jobs(Arc<Queue>);

impl Jobs {
    /// Resumes the work of an earlier process: waiting computations are kept; jobs waiting for the station are
    /// interrupted, because the person who authorised laser and motion may no longer be present. Called within the
    /// runtime, after the store has marked the jobs that were running.
    ///
    /// # Errors
    /// If the catalogue cannot be used.
    pub async fn start(parts: JobParts) -> Result<Self, StoreError> {
        Self::start_with(parts, Arc::new(run::by_kind)).await
    }

    /// With another procedure executing the jobs.
    async fn start_with(parts: JobParts, procedure: Procedure) -> Result<Self, StoreError> {
        let queue = Queue::new(parts, procedure);
        *queue.hold.lock() = stored_hold(&queue.parts.catalogue).await;
        scan::recover(&queue.parts.catalogue, &*queue.parts.artifacts).await;
        let waiting = queue.parts.catalogue.read().queue().await?;
        for row in &waiting.damaged {
            tracing::error!(job = row.id, "a waiting job is damaged in the database and will not run");
        }
        let authority = queue.nobodys_authority();
        for record in waiting.records {
            let end = match serde_json::from_value::<JobInput>(record.input.clone()) {
                Ok(input) if !input.needs_station() => {
                    // Stop does not affect a computation.
                    let _ = queue.push(Waiting { record, input, authority: authority.clone() });
                    continue;
                }
                Ok(_) => End::interrupted("the service was restarted while the job waited for the station"),
                Err(cause) => End::failed(
                    &AppError::new(ErrorKind::Internal, "the job was stored by an incompatible version")
                        .because(cause.to_string()),
                ),
            };
            queue.parts.catalogue.commit(end.changes(&record, None, now_ms())).await?;
        }
        queue.advance();
        Ok(Self(queue))
    }

    /// Accepts a job.
    #[cfg(test)]
    pub async fn submit(&self, input: JobInput, source: &str) -> Result<JobRecord, AppError> {
        let authority = self.0.nobodys_authority();
        self.submit_with(input, source, authority, |_| Vec::new()).await
    }

    /// Accepts a job durably; `source` names the requester, `authority` permits it to take the station. What `and`
    /// returns, such as the response stored for the idempotency key, is stored in the same transaction or not at all. A
    /// job accepted during a Stop is cancelled.
    ///
    /// # Errors
    /// A problem: `halted` if it needs a station that was stopped, `too-many` with a full queue, `storage-full`,
    /// `impossible` for an input that cannot work.
    pub async fn submit_with(
        &self,
        input: JobInput,
        source: &str,
        authority: Authority,
        and: impl FnOnce(&JobRecord) -> Vec<Change>,
    ) -> Result<JobRecord, AppError> {
        let queue = &self.0;
        if input.needs_station() && queue.parts.station.is_halted() {
            return Err(StationRefusal::Halted.into());
        }
        let needed_bytes = check::check(&input, &queue.parts).await?;
        let _turn = queue.turn.lock().await;
        queue.check_room(FREE_FLOOR_BYTES.saturating_add(needed_bytes))?;
        let record = queued_record(&input, source)?;
        let mut changes = and(&record);
        changes.push(Change::InsertJob(record.clone()));
        let body = job_event(&record, JobState::Queued);
        let body = JobEvent { source: Some(source.to_owned()), ..body };
        changes.push(event(&record.id, Event::JobQueued(body)));
        queue.parts.catalogue.commit(changes).await?;
        match queue.push(Waiting { record: record.clone(), input, authority }) {
            Ok(()) => queue.publish(record.clone().into()),
            Err(stopped) => self.end_jobs(vec![*stopped], &stopped_on_its_way(), source, Vec::new()).await?,
        }
        queue.advance();
        Ok(record)
    }

    /// Requests cancellation of a job in any state; returns the job.
    pub async fn cancel(&self, id: &str, actor: &str) -> Result<JobView, AppError> {
        self.0.cancel_running(|running| running.id == id);
        let _turn = self.0.turn.lock().await;
        self.0
            .cancel_waiting(id, &End::cancelled(&format!("cancelled by {actor} before it started")), actor)
            .await?;
        self.0.cancel_running(|running| running.id == id);
        self.view(id).await
    }

    /// The current state of a job.
    pub async fn view(&self, id: &str) -> Result<JobView, AppError> {
        // Before the catalogue is read: a caller woken by a job's end must not get its state before that.
        let running = self.0.running_views();
        match self.0.parts.catalogue.read().job(id).await {
            Ok(record) => Ok(now(record, &running)),
            Err(error) => match running.into_iter().find(|view| view.record.id == id) {
                Some(view) => Ok(view),
                None => Err(error.into()),
            },
        }
    }

    /// The current state of jobs, newest first.
    pub async fn list(&self, state: Option<JobState>, page: &store::Page) -> Result<Listed<JobView>, AppError> {
        let running = self.0.running_views();
        let listed = self.0.parts.catalogue.read().jobs(state, page).await?;
        Ok(listed.map(|record| now(record, &running)))
    }

    /// Changes with every progress of any job; holds the newest progress of each.
    pub fn watch_progress(&self) -> watch::Receiver<JobNews> {
        self.0.progress.subscribe()
    }

    /// After the stop was latched: empties the station's queue and cancels its running job. Does not block; pass the
    /// returned jobs to [`Jobs::end_cleared_jobs`].
    pub fn clear_station_jobs(&self) -> Vec<Waiting> {
        self.0.clear_station()
    }

    /// Stores that these jobs were ended by a Stop, together with `also`, in one transaction.
    ///
    /// # Errors
    /// If the catalogue cannot be written; the next start marks the jobs as interrupted.
    pub async fn end_cleared_jobs(
        &self,
        cleared: Vec<Waiting>,
        actor: &str,
        also: Vec<Change>,
    ) -> Result<(), StoreError> {
        let end = End::cancelled(&format!("the station was stopped by {actor}"));
        self.end_jobs(cleared, &end, actor, also).await
    }

    async fn end_jobs(
        &self,
        ended: Vec<Waiting>,
        end: &End,
        actor: &str,
        also: Vec<Change>,
    ) -> Result<(), StoreError> {
        let at_ms = now_ms();
        let mut changes = also;
        for waiting in &ended {
            changes.extend(end.changes(&waiting.record, Some(actor), at_ms));
        }
        let stored = self.0.parts.catalogue.commit(changes).await;
        for waiting in ended {
            let mut record = waiting.record;
            record.state = end.state();
            self.0.publish(record.into());
        }
        stored.map(drop)
    }

    /// Whether a job waits for the station or has it.
    pub fn is_station_job(&self, id: &str) -> bool {
        self.0.is_station_job(id)
    }

    /// Starts a job that waited for control to be released, if it may start now.
    pub fn recheck_control(&self) {
        self.0.advance();
    }

    /// Starts no further jobs.
    pub fn close(&self) {
        self.0.close();
    }

    /// Starts no further jobs, interrupts running ones, and waits for them.
    pub async fn shut_down(&self) {
        self.0.shut_down().await;
    }
}

/// The current state of a stored job: its end as stored, before that as its thread reports.
fn now(record: JobRecord, running: &[JobView]) -> JobView {
    let current = running.iter().find(|view| view.record.id == record.id);
    match current.filter(|_| !record.state.is_terminal()) {
        Some(view) => view.clone(),
        None => record.into(),
    }
}

fn stopped_on_its_way() -> End {
    End::cancelled("the station was stopped while the job was being accepted")
}

fn queued_record(input: &JobInput, source: &str) -> Result<JobRecord, AppError> {
    let input_json = serde_json::to_value(input).map_err(|cause| {
        AppError::new(ErrorKind::Internal, "the job cannot be stored").because(cause.to_string())
    })?;
    Ok(JobRecord {
        id: uuid::Uuid::now_v7().to_string(),
        kind: input.kind().to_owned(),
        state: JobState::Queued,
        input: input_json,
        source: source.to_owned(),
        progress: 0.0,
        message: "waiting".to_owned(),
        result: None,
        problem: None,
        checkpoint: None,
        created_at_ms: now_ms(),
        started_at_ms: None,
        ended_at_ms: None,
    })
}

impl Queue {
    /// The current authority of a caller who is not in control.
    fn nobodys_authority(&self) -> Authority {
        Authority { holder: None, epoch: self.parts.station.stop_epoch() }
    }

    fn check_room(&self, needed_bytes: u64) -> Result<(), AppError> {
        if self.is_closing() {
            return Err(
                AppError::new(ErrorKind::Unavailable, "the service is shutting down").retry_after_s(RETRY_AFTER_S)
            );
        }
        if self.n_waiting() >= QUEUE_LIMIT {
            return Err(AppError::new(ErrorKind::TooMany, format!("the queue is full with {QUEUE_LIMIT} jobs"))
                .remedy("wait until some have ended, or cancel some")
                .retry_after_s(RETRY_AFTER_S));
        }
        let free_bytes = (self.parts.free_bytes)();
        if free_bytes < needed_bytes {
            return Err(AppError::new(
                ErrorKind::StorageFull,
                format!(
                    "the job needs {} MiB of disk space, {} MiB are free",
                    needed_bytes >> 20,
                    free_bytes >> 20
                ),
            )
            .remedy("delete captures or scans that are no longer needed"));
        }
        Ok(())
    }
}
