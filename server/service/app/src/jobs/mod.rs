//! Jobs: what takes seconds, is asked for once, survives the browser that asked, and ends in a stated way.
//!
//! A job is accepted durably, waits in a queue, runs on a thread of its own, and ends together with what it made in
//! one transaction. A [`StationJob`] needs the station, and they run one at a time; a [`ComputeJob`] is a function of
//! records and artifacts, and they run one at a time beside them.

pub mod calibrate;
mod check;
mod context;
mod end;
pub mod export;
pub mod input;
pub mod plan;
mod queue;
pub mod recompute;
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
pub use input::{CalibrateInput, ExportInput, JobInput, RecomputeInput, ScanInput, Source, VerifyInput};
pub use queue::lane::Waiting;

use crate::events::{Event, JobEvent, event};
use std::sync::Arc;

use store::{Artifacts, Change, JobRecord, JobState, Listed, StoreError};
use tokio::sync::watch;

use crate::access::lease::{Authority, ControlDesk};
use crate::config::AppConfig;
use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::queue::params::{QUEUE_LIMIT, RETRY_AFTER_S};
use crate::jobs::queue::run::Procedure;
use crate::jobs::queue::runner::{End, job_event};
use crate::progress::Step;
use crate::recordings::Recordings;
use crate::resources::captures::Captures;
use live::LiveBus;
use queue::{Queue, run};
use station::wall_clock::now_ms;
use station::{StationHandle, StationRefusal};

/// A job as a client sees it: the record, with the progress of this moment.
#[derive(Debug, Clone)]
pub struct JobView {
    /// As stored, with progress and message of this moment.
    pub record: JobRecord,
    /// What it does at this moment; `None` if it does nothing.
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
    /// How the station is set up.
    pub config: Arc<AppConfig>,
    /// The catalogue and its events.
    pub ledger: EventedCatalogue,
    /// What records name.
    pub artifacts: Arc<dyn Artifacts>,
    /// Captures as folders.
    pub captures: Captures,
    /// The hardware.
    pub station: StationHandle,
    /// Who is in control.
    pub control: ControlDesk,
    /// What is seen at this moment.
    pub live: LiveBus,
    /// What is recorded of it.
    pub recordings: Recordings,
    /// Bytes free on the disk of the data directory.
    pub free_bytes: Arc<dyn Fn() -> u64 + Send + Sync>,
}

/// The queue and its runners.
#[derive(Clone)]
pub struct Jobs(Arc<Queue>);

impl Jobs {
    /// Takes up the work where an earlier process left it: computations that wait go on; jobs that wait for the
    /// station are interrupted, because nobody who authorised light and motion may still stand there. Called within
    /// the runtime, after the store has marked the jobs that died.
    ///
    /// # Errors
    /// If the catalogue cannot be used.
    pub async fn start(parts: JobParts) -> Result<Self, StoreError> {
        Self::start_with(parts, Arc::new(run::by_kind)).await
    }

    /// With another procedure behind the queue.
    async fn start_with(parts: JobParts, procedure: Procedure) -> Result<Self, StoreError> {
        let queue = Queue::new(parts, procedure);
        scan::recover(&queue.parts.ledger, &*queue.parts.artifacts).await;
        let waiting = queue.parts.ledger.read().queue().await?;
        for row in &waiting.damaged {
            tracing::error!(job = row.id, "a waiting job is damaged in the database and will not be done");
        }
        let authority = queue.nobodys_authority();
        for record in waiting.records {
            let end = match serde_json::from_value::<JobInput>(record.input.clone()) {
                Ok(input) if !input.needs_station() => {
                    // A computation waits for no Stop.
                    let _ = queue.push(Waiting { record, input, authority: authority.clone() });
                    continue;
                }
                Ok(_) => End::interrupted("the service was restarted while the job waited for the station"),
                Err(cause) => End::failed(
                    &AppError::new(ErrorKind::Internal, "the job was stored by a program this one does not know")
                        .because(cause.to_string()),
                ),
            };
            queue.parts.ledger.commit(end.changes(&record.id, &record.kind, None, now_ms())).await?;
        }
        queue.advance();
        Ok(Self(queue))
    }

    /// Accepts a job and nothing else.
    #[cfg(test)]
    pub async fn submit(&self, input: JobInput, source: &str) -> Result<JobRecord, AppError> {
        let authority = self.0.nobodys_authority();
        self.submit_with(input, source, authority, |_| Vec::new()).await
    }

    /// Accepts a job durably; `source` says who asked, `authority` on whose word it takes the station. What `and`
    /// returns, such as the answer that is kept for the request's key, is stored in the same transaction or not at
    /// all. A job that a Stop meets on its way is accepted and cancelled.
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
        let body = job_event(&record.id, &record.kind, JobState::Queued);
        let body = JobEvent { source: Some(source.to_owned()), ..body };
        changes.push(event(&record.id, Event::JobQueued(body)));
        queue.parts.ledger.commit(changes).await?;
        match queue.push(Waiting { record: record.clone(), input, authority }) {
            Ok(()) => queue.publish(record.clone().into()),
            Err(stopped) => self.end_jobs(vec![*stopped], &stopped_on_its_way(), source, Vec::new()).await?,
        }
        queue.advance();
        Ok(record)
    }

    /// Asks a job to end; works in every state, returns the job as it is then.
    pub async fn cancel(&self, id: &str, actor: &str) -> Result<JobView, AppError> {
        self.0.cancel_running(|running| running.id == id);
        let _turn = self.0.turn.lock().await;
        self.0
            .cancel_waiting(id, &End::cancelled(&format!("cancelled by {actor} before it began")), actor)
            .await?;
        self.0.cancel_running(|running| running.id == id);
        self.view(id).await
    }

    /// A job now.
    pub async fn view(&self, id: &str) -> Result<JobView, AppError> {
        // Before the catalogue is read: a caller woken by a job's end must not get its state before that.
        let running = self.0.running_views();
        match self.0.parts.ledger.read().job(id).await {
            Ok(record) => Ok(now(record, &running)),
            Err(error) => match running.into_iter().find(|view| view.record.id == id) {
                Some(view) => Ok(view),
                None => Err(error.into()),
            },
        }
    }

    /// Jobs now, newest first.
    pub async fn list(&self, state: Option<JobState>, page: &store::Page) -> Result<Listed<JobView>, AppError> {
        let running = self.0.running_views();
        let listed = self.0.parts.ledger.read().jobs(state, page).await?;
        Ok(listed.map(|record| now(record, &running)))
    }

    /// Changes with every progress of any job; carries the newest word of each.
    pub fn watch_progress(&self) -> watch::Receiver<JobNews> {
        self.0.progress.subscribe()
    }

    /// After the stop line was pulled: empties the station's queue and ends the job that has it. Waits for nothing;
    /// the jobs that it returns are to be given to [`Jobs::end_cleared_jobs`].
    pub fn clear_station_jobs(&self) -> Vec<Waiting> {
        self.0.clear_station()
    }

    /// Stores that these jobs were ended by a Stop, and `also`, in one transaction.
    ///
    /// # Errors
    /// If the catalogue cannot be written; the next start calls the jobs interrupted.
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
            changes.extend(end.changes(&waiting.record.id, waiting.input.kind(), Some(actor), at_ms));
        }
        let stored = self.0.parts.ledger.commit(changes).await;
        for waiting in ended {
            let mut record = waiting.record;
            record.state = end.state();
            self.0.publish(record.into());
        }
        stored.map(drop)
    }

    /// Whether a job waits for the station or has it; one that has ended does not.
    pub fn is_station_job(&self, id: &str) -> bool {
        self.0.is_station_job(id)
    }

    /// Looks whether a job may begin that waited for somebody to give control back.
    pub fn look_again(&self) {
        self.0.advance();
    }

    /// Begins nothing any more.
    pub fn close(&self) {
        self.0.close();
    }

    /// Begins nothing any more, ends what runs as interrupted, and waits for that.
    pub async fn shut_down(&self) {
        self.0.shut_down().await;
    }
}

/// A stored job as it is now: its end as stored, until then as its thread reports.
fn now(record: JobRecord, running: &[JobView]) -> JobView {
    let told = running.iter().find(|view| view.record.id == record.id);
    match told.filter(|_| !record.state.is_terminal()) {
        Some(view) => view.clone(),
        None => record.into(),
    }
}

fn stopped_on_its_way() -> End {
    End::cancelled("the station was stopped while the job was accepted")
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
    /// The authority of who is not in control, now.
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
            return Err(AppError::new(ErrorKind::TooMany, format!("{QUEUE_LIMIT} jobs wait already"))
                .remedy("wait until some have ended, or cancel some")
                .retry_after_s(RETRY_AFTER_S));
        }
        let free_bytes = (self.parts.free_bytes)();
        if free_bytes < needed_bytes {
            return Err(AppError::new(
                ErrorKind::StorageFull,
                format!("the job needs {} MiB of disk, {} MiB are free", needed_bytes >> 20, free_bytes >> 20),
            )
            .remedy("delete captures or scans that are no longer needed"));
        }
        Ok(())
    }
}
