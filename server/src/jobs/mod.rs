//! Jobs: what takes seconds, is asked for once, survives the browser that asked, and ends in a stated way.
//!
//! A job is accepted durably, waits in a queue, runs on a thread of its own, and ends together with what it made in
//! one transaction. Jobs that need the station run one at a time; computations run one at a time beside them.

mod board;
pub mod calibrate;
mod check;
pub mod context;
pub mod export;
pub mod input;
mod lane;
pub mod params;
pub mod plan;
mod queue;
pub mod recompute;
mod remaining;
mod run;
mod runner;
pub mod scan;
#[cfg(test)]
mod tests;
pub mod verify;

pub use context::{Done, JobContext, JobEnd};
pub use input::{
    CalibrateInput, ExportInput, JobInput, RecomputeInput, ScanInput, ScanMode, ScanSource, Source, VerifyInput,
};

use std::sync::Arc;

use serde_json::json;
use store::{Artifacts, Change, JobRecord, JobState, Listed, StoreError};
use tokio::sync::watch;

use crate::captures::Captures;
use crate::config::Config;
use crate::jobs::lane::Waiting;
use crate::jobs::params::{FREE_FLOOR_BYTES, QUEUE_LIMIT, RETRY_AFTER_S};
use crate::jobs::run::Procedure;
use crate::jobs::runner::End;
use crate::ledger::{Ledger, event};
use crate::live::LiveBus;
use crate::problem::{Problem, ProblemKind};
use crate::progress::Step;
use crate::station::StationHandle;
use crate::wall_clock::now_ms;
use queue::Queue;

/// A job as a client sees it: the record, with the progress of this moment.
#[derive(Debug, Clone)]
pub struct JobView {
    /// As stored, with progress and message of this moment.
    pub record: JobRecord,
    /// What it does at this moment; `None` if it does nothing.
    pub step: Option<Step>,
    /// Seconds to its end; `None` if it cannot be told.
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
    pub config: Arc<Config>,
    /// The catalogue and its events.
    pub ledger: Ledger,
    /// What records name.
    pub artifacts: Arc<dyn Artifacts>,
    /// Captures as folders.
    pub captures: Captures,
    /// The hardware.
    pub station: StationHandle,
    /// What is seen at this moment.
    pub live: LiveBus,
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
        for record in waiting.records {
            let end = match serde_json::from_value::<JobInput>(record.input.clone()) {
                Ok(input) if !input.needs_station() => {
                    queue.push(Waiting { record, input });
                    continue;
                }
                Ok(_) => End::interrupted("the service was restarted while the job waited for the station"),
                Err(cause) => End::failed(
                    &Problem::new(ProblemKind::Internal, "the job was stored by a program this one does not know")
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
    pub async fn submit(&self, input: JobInput, source: &str) -> Result<JobRecord, Problem> {
        self.submit_with(input, source, |_| Vec::new()).await
    }

    /// Accepts a job durably; `source` says who asked. What `and` returns, such as the answer that is kept for the
    /// request's key, is stored in the same transaction or not at all.
    ///
    /// # Errors
    /// A problem: `too-many` with a full queue, `storage-full`, `impossible` for an input that cannot work.
    pub async fn submit_with(
        &self,
        input: JobInput,
        source: &str,
        and: impl FnOnce(&JobRecord) -> Vec<Change>,
    ) -> Result<JobRecord, Problem> {
        let queue = &self.0;
        let needed_bytes = check::check(&input, &queue.parts).await?;
        let _turn = queue.turn.lock().await;
        queue.check_room(FREE_FLOOR_BYTES.saturating_add(needed_bytes))?;
        let record = queued_record(&input, source)?;
        let mut changes = and(&record);
        changes.push(Change::InsertJob(record.clone()));
        let told = json!({ "id": record.id, "kind": record.kind, "state": "queued", "source": source });
        changes.push(event("job.queued", &record.id, told));
        queue.parts.ledger.commit(changes).await?;
        queue.push(Waiting { record: record.clone(), input });
        queue.publish(record.clone().into());
        queue.advance();
        Ok(record)
    }

    /// Asks a job to end; works in every state, returns the job as it is then.
    pub async fn cancel(&self, id: &str, actor: &str) -> Result<JobView, Problem> {
        self.0.cancel_running(|running| running.id == id);
        let _turn = self.0.turn.lock().await;
        self.0
            .cancel_waiting(id, &End::cancelled(&format!("cancelled by {actor} before it began")), actor)
            .await?;
        self.0.cancel_running(|running| running.id == id);
        self.view(id).await
    }

    /// A job now.
    pub async fn view(&self, id: &str) -> Result<JobView, Problem> {
        // Before the catalogue is read: who comes with the news of an end must not be told the moment before.
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
    pub async fn list(&self, state: Option<JobState>, page: &store::Page) -> Result<Listed<JobView>, Problem> {
        let running = self.0.running_views();
        let listed = self.0.parts.ledger.read().jobs(state, page).await?;
        Ok(listed.map(|record| now(record, &running)))
    }

    /// Changes with every progress of any job; carries the job that moved.
    pub fn watch_progress(&self) -> watch::Receiver<Option<JobView>> {
        self.0.progress.subscribe()
    }

    /// After Stop: ends the running station job and takes the station jobs that wait out of the queue.
    pub async fn stop_station_jobs(&self, actor: &str) {
        let queue = &self.0;
        // At once, before anything that could wait.
        queue.cancel_running_station_job();
        let _turn = queue.turn.lock().await;
        let end = End::cancelled(&format!("the station was stopped by {actor}"));
        for id in queue.waiting_for_station() {
            if let Err(problem) = queue.cancel_waiting(&id, &end, actor).await {
                tracing::error!(job = %id, problem = %problem.detail, "a waiting job cannot be cancelled after Stop");
            }
        }
        queue.cancel_running_station_job();
    }

    /// Begins nothing any more, ends what runs as interrupted, and waits for that.
    pub async fn shut_down(&self) {
        self.0.shut_down().await;
    }
}

/// A stored job as it is now: its end as stored, until then as its thread tells.
fn now(record: JobRecord, running: &[JobView]) -> JobView {
    let told = running.iter().find(|view| view.record.id == record.id);
    match told.filter(|_| !record.state.is_terminal()) {
        Some(view) => view.clone(),
        None => record.into(),
    }
}

fn queued_record(input: &JobInput, source: &str) -> Result<JobRecord, Problem> {
    let input_json = serde_json::to_value(input).map_err(|cause| {
        Problem::new(ProblemKind::Internal, "the job cannot be stored").because(cause.to_string())
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
    fn check_room(&self, needed_bytes: u64) -> Result<(), Problem> {
        if self.is_closing() {
            return Err(Problem::new(ProblemKind::Unavailable, "the service is shutting down")
                .retry_after_s(RETRY_AFTER_S));
        }
        if self.n_waiting() >= QUEUE_LIMIT {
            return Err(Problem::new(ProblemKind::TooMany, format!("{QUEUE_LIMIT} jobs wait already"))
                .remedy("wait until some have ended, or cancel some")
                .retry_after_s(RETRY_AFTER_S));
        }
        let free_bytes = (self.parts.free_bytes)();
        if free_bytes < needed_bytes {
            return Err(Problem::new(
                ProblemKind::StorageFull,
                format!("the job needs {} MiB of disk, {} MiB are free", needed_bytes >> 20, free_bytes >> 20),
            )
            .remedy("delete captures or scans that are no longer needed"));
        }
        Ok(())
    }
}
