//! Runs a job on its thread: start stored durably, executed, end stored in one transaction with its results.

use crate::events::{Event, JobEvent, JobResult, event};
use std::sync::Arc;

use serde::Deserialize as _;
use serde_json::{Value, json};
use station::wall_clock::now_ms;
use store::{Change, JobOutcome, JobRecord, JobState, Page, ResultRef, StoreError};

use crate::error::AppError;
use crate::jobs::progress::Warnings;
use crate::jobs::queue::forecast::Forecast;
use crate::jobs::queue::lane::Running;
use crate::jobs::queue::params::{CHECKPOINT_INTERVAL, FORECAST_ALIKE, FORECAST_JOBS, PUBLISH_INTERVAL};
use crate::jobs::queue::run;
use crate::jobs::{ComputeContext, Done, JobEnd, JobInput, Queue, StationContext, Waiting, scan};

/// Key of the timeline in a job's checkpoint, used to forecast similar jobs.
const TIMELINE: &str = "timeline";

/// Key of the class of similar jobs in a timeline.
const CLASS: &str = "duration_class";

/// How a job ended, as it is stored and published.
pub(in crate::jobs) struct End {
    outcome: JobOutcome,
    message: String,
    changes: Vec<Change>,
    finished_work: Option<String>,
}

impl End {
    pub fn of(result: Result<Done, JobEnd>, shutting_down: bool) -> Self {
        match result {
            Ok(Done { result, message, changes, finished_work }) => {
                Self { outcome: JobOutcome::Succeeded(result), message, changes, finished_work }
            }
            Err(JobEnd::CancelledAfter(kept)) => {
                let Done { changes, finished_work, .. } = *kept;
                Self { changes, finished_work, ..Self::of(Err(JobEnd::Cancelled), shutting_down) }
            }
            Err(JobEnd::Cancelled) if shutting_down => Self::interrupted("the service was shut down"),
            Err(JobEnd::Cancelled) => Self::cancelled("cancelled"),
            Err(JobEnd::Failed(problem)) => Self::failed(&problem),
        }
    }

    pub fn cancelled(message: &str) -> Self {
        Self::bare(JobOutcome::Cancelled, message)
    }

    pub fn interrupted(message: &str) -> Self {
        Self::bare(JobOutcome::Interrupted, message)
    }

    pub fn failed(problem: &AppError) -> Self {
        Self::bare(JobOutcome::Failed(json!(problem)), &problem.detail)
    }

    fn bare(outcome: JobOutcome, message: &str) -> Self {
        Self { outcome, message: message.to_owned(), changes: Vec::new(), finished_work: None }
    }

    pub fn state(&self) -> JobState {
        match self.outcome {
            JobOutcome::Succeeded(_) => JobState::Succeeded,
            JobOutcome::Failed(_) => JobState::Failed,
            JobOutcome::Cancelled => JobState::Cancelled,
            JobOutcome::Interrupted => JobState::Interrupted,
        }
    }

    fn result(&self) -> Option<ResultRef> {
        if let JobOutcome::Succeeded(result) = &self.outcome { Some(result.clone()) } else { None }
    }

    fn problem(&self) -> Option<Value> {
        if let JobOutcome::Failed(problem) = &self.outcome { Some(problem.clone()) } else { None }
    }

    /// All changes at this end, to be committed together.
    pub fn changes(&self, job: &JobRecord, actor: Option<&str>, at_ms: i64) -> Vec<Change> {
        let mut changes = self.changes.clone();
        changes.push(Change::EndJob {
            id: job.id.clone(),
            outcome: self.outcome.clone(),
            message: self.message.clone(),
            at_ms,
        });
        let body = JobEvent {
            message: Some(self.message.clone()),
            result: self.result().map(|result| JobResult { kind: result.kind, id: result.id }),
            problem: self.problem().and_then(|problem| serde_json::from_value(problem).ok()),
            actor: actor.map(str::to_owned),
            ..job_event(job, self.state())
        };
        let ended = match self.outcome {
            JobOutcome::Succeeded(_) => Event::JobSucceeded(body),
            JobOutcome::Failed(_) => Event::JobFailed(body),
            JobOutcome::Cancelled => Event::JobCancelled(body),
            JobOutcome::Interrupted => Event::JobInterrupted(body),
        };
        changes.push(event(&job.id, ended));
        changes
    }
}

/// The common fields of a job event. An inspection without a result is thus known by its part.
pub(in crate::jobs) fn job_event(job: &JobRecord, state: JobState) -> JobEvent {
    let inspected = match JobInput::deserialize(&job.input) {
        Ok(JobInput::Inspection(input)) => Some(input),
        _ => None,
    };
    JobEvent {
        id: job.id.clone(),
        kind: job.kind.clone(),
        state: state_name(state).to_owned(),
        recipe: inspected.as_ref().map(|input| format!("{}@{}", input.recipe_id, input.recipe_version)),
        serial: inspected.as_ref().map(|input| input.part.serial.clone()),
        order: inspected.and_then(|input| input.part.order),
        ..JobEvent::default()
    }
}

/// The code of the state in events, as in the API.
fn state_name(state: JobState) -> &'static str {
    match state {
        JobState::Queued => "queued",
        JobState::Running => "running",
        JobState::Succeeded => "succeeded",
        JobState::Failed => "failed",
        JobState::Cancelled => "cancelled",
        JobState::Interrupted => "interrupted",
    }
}

impl Queue {
    /// Runs one job on the calling thread.
    pub(in crate::jobs) fn live(&self, waiting: Waiting, running: &Running) {
        let ticker = self.runtime.spawn(tick(self.this(), running.clone()));
        let (class, size) = (waiting.input.duration_class(), waiting.input.size());
        running.progress.set_forecast(self.forecast(&class, size));
        let result = self.begin(running).map_err(JobEnd::from).and_then(|()| {
            let context = self.context(running);
            context.check_cancelled()?;
            run::run(&self.procedure, waiting.input, &context)
        });
        ticker.abort();
        let mut end = End::of(result, self.is_closing());
        if end.state() == JobState::Succeeded {
            let mut timeline = running.progress.timeline(size);
            timeline[CLASS] = json!(class);
            end.changes.push(Change::CheckpointJob {
                id: running.id.clone(),
                progress: 1.0,
                message: end.message.clone(),
                checkpoint: Some(json!({ TIMELINE: timeline })),
            });
        }
        self.end(running, end);
    }

    /// The forecast for this job, from recent similar jobs.
    fn forecast(&self, class: &str, size: f64) -> Option<Forecast> {
        let newest = Page { before: None, limit: FORECAST_JOBS };
        let ended =
            self.runtime.block_on(self.parts.catalogue.read().jobs(Some(JobState::Succeeded), &newest)).ok()?;
        let timelines = ended.records.into_iter().filter_map(|record| Some(record.checkpoint?[TIMELINE].clone()));
        let alike = timelines.filter(|timeline| timeline[CLASS] == class);
        Forecast::of(&alike.take(FORECAST_ALIKE).collect::<Vec<_>>(), size)
    }

    fn begin(&self, running: &Running) -> Result<(), StoreError> {
        let at_ms = now_ms();
        let start = Change::StartJob { id: running.id.clone(), at_ms };
        let job = running.progress.view().record;
        let started = event(&running.id, Event::JobRunning(job_event(&job, JobState::Running)));
        self.runtime.block_on(self.parts.catalogue.commit(vec![start, started]))?;
        running.progress.change(|record| {
            record.state = JobState::Running;
            record.started_at_ms = Some(at_ms);
        });
        Ok(())
    }

    fn context(&self, running: &Running) -> StationContext {
        let progress = running.progress.clone();
        let parts = self.parts.clone();
        let compute = ComputeContext {
            id: running.id.clone(),
            cancel: running.cancel.clone(),
            config: parts.config,
            catalogue: parts.catalogue,
            artifacts: parts.artifacts,
            captures: parts.captures,
            runtime: self.runtime.clone(),
            progress: Arc::new(move |fraction, step, message| progress.report(fraction, step, message)),
            warnings: Warnings::default(),
        };
        StationContext {
            compute,
            station: parts.station,
            authority: running.authority.clone(),
            live: parts.live,
            recordings: parts.recordings,
        }
    }

    /// Stores the end together with the results; if that fails, the results are discarded and the job has failed.
    fn end(&self, running: &Running, end: End) {
        let at_ms = now_ms();
        let job = running.progress.view().record;
        let commit =
            |end: &End| self.runtime.block_on(self.parts.catalogue.commit(end.changes(&job, None, at_ms)));
        let end = match commit(&end) {
            Ok(_) => {
                if let Some(scan_id) = &end.finished_work {
                    scan::clear_work(&*self.parts.artifacts, scan_id);
                }
                end
            }
            Err(error) => {
                tracing::error!(job = %running.id, %error, "the end of a job cannot be stored");
                let failed = End::failed(&error.into());
                if let Err(error) = commit(&failed) {
                    tracing::error!(job = %running.id, %error, "the failure cannot be stored either");
                    self.remember_unsaved(running);
                }
                failed
            }
        };
        running.progress.change(|record| {
            record.state = end.state();
            record.message.clone_from(&end.message);
            record.result = end.result();
            record.problem = end.problem();
            record.ended_at_ms = Some(at_ms);
            if record.state == JobState::Succeeded {
                record.progress = 1.0;
            }
        });
        self.publish(running.progress.view());
    }
}

/// Publishes and stores the progress at intervals until it is aborted.
async fn tick(queue: Arc<Queue>, running: Running) {
    let mut stored_at = tokio::time::Instant::now();
    let mut interval = tokio::time::interval(PUBLISH_INTERVAL);
    interval.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        interval.tick().await;
        if let Some(view) = running.progress.news() {
            queue.publish(view);
        }
        if stored_at.elapsed() >= CHECKPOINT_INTERVAL {
            stored_at = tokio::time::Instant::now();
            if let Some(change) = running.progress.checkpoint()
                && let Err(error) = queue.parts.catalogue.commit(vec![change]).await
            {
                tracing::warn!(job = %running.id, %error, "progress cannot be stored");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::{ExportInput, InspectInput, ScanSource, queued_record};
    use crate::resources::inspections::InspectedPart;

    #[test]
    fn a_failed_inspection_is_known_by_its_part() {
        let part = InspectedPart { serial: "S-7".into(), order: Some("4711".into()), attributes: [].into() };
        let input = InspectInput { recipe_id: "lid".into(), recipe_version: 3, part, source: ScanSource::Station };
        let job = queued_record(&JobInput::Inspection(input), "rest").unwrap();
        let end = End::failed(&AppError::new(crate::error::ErrorKind::Internal, "the camera is disconnected"));
        let Some(Change::AppendEvent(failed)) = end.changes(&job, None, 1).pop() else { panic!("no event") };
        let named = |name: &str| failed.body[name].as_str();
        assert_eq!((failed.kind.as_str(), named("recipe")), ("job.failed", Some("lid@3")));
        assert_eq!((named("serial"), named("order")), (Some("S-7"), Some("4711")));
    }

    #[test]
    fn another_job_has_no_part() {
        let input = ExportInput { scan_id: "s".into(), what: "cloud".into(), format: "ply".into() };
        let job = queued_record(&JobInput::Export(input), "rest").unwrap();
        let body = serde_json::to_value(job_event(&job, JobState::Running)).unwrap();
        assert!(["recipe", "serial", "order"].iter().all(|name| body.get(name).is_none()), "{body}");
    }
}
