use serde_json::json;
use store::{Change, JobOutcome, JobState, Page, ResultRef, StoreError};

use super::stores;
use crate::common::{event, first, job};

fn start(id: &str) -> Change {
    Change::StartJob { id: id.into(), at_ms: 10 }
}

fn end(id: &str, outcome: JobOutcome) -> Change {
    Change::EndJob { id: id.into(), outcome, message: "over".into(), at_ms: 20 }
}

fn checkpoint(id: &str, checkpoint: Option<serde_json::Value>) -> Change {
    Change::CheckpointJob { id: id.into(), progress: 0.5, message: "row 7 of 14".into(), checkpoint }
}

fn is_refused(error: &StoreError) -> bool {
    matches!(error, StoreError::Refused { kind: "job", .. })
}

#[tokio::test]
async fn a_stored_job_is_returned_unchanged() {
    for fresh in stores().await {
        let mut full = job();
        full.state = JobState::Failed;
        full.problem = Some(json!({"type": "stage-stalled", "status": 503}));
        full.checkpoint = Some(json!({"row": 3, "σ": 0.1}));
        full.started_at_ms = Some(1);
        full.ended_at_ms = Some(2);
        for job in [job(), full] {
            fresh.store.catalogue.commit(vec![Change::InsertJob(job.clone())]).await.unwrap();
            assert_eq!(fresh.store.catalogue.job(&job.id).await.unwrap(), job);
        }
    }
}

#[tokio::test]
async fn a_job_goes_from_queued_through_running_to_its_end() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let job = job();
        let id = job.id.as_str();
        catalogue.commit(vec![Change::InsertJob(job.clone()), start(id)]).await.unwrap();
        catalogue.commit(vec![checkpoint(id, Some(json!({"row": 7})))]).await.unwrap();
        catalogue.commit(vec![checkpoint(id, None)]).await.unwrap();
        let running = catalogue.job(id).await.unwrap();
        assert_eq!((running.state, running.started_at_ms, running.progress), (JobState::Running, Some(10), 0.5));
        assert_eq!(running.checkpoint, Some(json!({"row": 7})), "no new checkpoint keeps the old one");

        let made = ResultRef { kind: "scan".into(), id: "s1".into() };
        catalogue.commit(vec![end(id, JobOutcome::Succeeded(made.clone()))]).await.unwrap();
        let over = catalogue.job(id).await.unwrap();
        assert_eq!((over.state, over.ended_at_ms, over.progress), (JobState::Succeeded, Some(20), 1.0));
        assert_eq!((over.result, over.message.as_str()), (Some(made), "over"));
    }
}

#[tokio::test]
async fn a_job_starts_once_and_ends_once() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let job = job();
        let id = job.id.as_str();
        catalogue.commit(vec![Change::InsertJob(job.clone())]).await.unwrap();
        assert!(is_refused(&catalogue.commit(vec![checkpoint(id, None)]).await.unwrap_err()));
        catalogue.commit(vec![start(id)]).await.unwrap();
        assert!(is_refused(&catalogue.commit(vec![start(id)]).await.unwrap_err()));
        catalogue.commit(vec![end(id, JobOutcome::Cancelled)]).await.unwrap();
        for late in [start(id), checkpoint(id, None), end(id, JobOutcome::Failed(json!({})))] {
            assert!(is_refused(&catalogue.commit(vec![late]).await.unwrap_err()));
        }
        assert_eq!(catalogue.job(id).await.unwrap().state, JobState::Cancelled);
        let again = catalogue.commit(vec![Change::InsertJob(job.clone())]).await.unwrap_err();
        assert!(matches!(again, StoreError::Exists { kind: "job", .. }));
        for missing in [start("no"), checkpoint("no", None), end("no", JobOutcome::Cancelled)] {
            let error = catalogue.commit(vec![missing]).await.unwrap_err();
            assert!(matches!(error, StoreError::NotFound { kind: "job", .. }));
        }
    }
}

#[tokio::test]
async fn the_queue_is_oldest_first_and_lists_are_newest_first() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let jobs = [job(), job(), job()];
        catalogue.commit(jobs.iter().cloned().map(Change::InsertJob).collect()).await.unwrap();
        catalogue.commit(vec![start(&jobs[1].id)]).await.unwrap();
        let ids = |jobs: Vec<store::JobRecord>| jobs.into_iter().map(|job| job.id).collect::<Vec<_>>();
        let [a, b, c] = jobs.map(|job| job.id);
        assert_eq!(ids(catalogue.queue().await.unwrap().records), [a.clone(), c.clone()]);
        assert_eq!(ids(catalogue.jobs(None, &first(9)).await.unwrap().records), [c.clone(), b.clone(), a.clone()]);
        assert_eq!(
            ids(catalogue.jobs(Some(JobState::Running), &first(9)).await.unwrap().records),
            std::slice::from_ref(&b)
        );
        let below_c = Page { before: Some(c), limit: 9 };
        assert_eq!(ids(catalogue.jobs(Some(JobState::Queued), &below_c).await.unwrap().records), [a]);
    }
}

#[tokio::test]
async fn recovery_interrupts_running_jobs_and_keeps_queued_ones() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let (waiting, running, over) = (job(), job(), job());
        let inserts = [&waiting, &running, &over].map(|job| Change::InsertJob(job.clone()));
        let mut changes = inserts.to_vec();
        changes.extend([start(&running.id), start(&over.id), end(&over.id, JobOutcome::Cancelled)]);
        changes.extend([checkpoint(&running.id, Some(json!({"row": 3}))), Change::AppendEvent(event("x"))]);
        catalogue.commit(changes).await.unwrap();

        let events = fresh.store.recover(99).await.unwrap();
        let appended: Vec<_> = events.iter().map(|event| (event.kind.as_str(), event.subject.as_str())).collect();
        assert_eq!(appended, [("job.interrupted", running.id.as_str())]);
        let interrupted = catalogue.job(&running.id).await.unwrap();
        assert_eq!((interrupted.state, interrupted.ended_at_ms), (JobState::Interrupted, Some(99)));
        assert_eq!(interrupted.checkpoint, Some(json!({"row": 3})), "it can still be resumed");
        assert_eq!(catalogue.job(&waiting.id).await.unwrap(), waiting);
        assert_eq!(catalogue.job(&over.id).await.unwrap().state, JobState::Cancelled);
        assert!(fresh.store.recover(100).await.unwrap().is_empty());
    }
}

#[tokio::test]
async fn ended_jobs_are_pruned_by_age_and_number_and_others_are_kept() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let ended_at = |state, ended_at_ms| {
            let mut job = job();
            (job.state, job.ended_at_ms) = (state, ended_at_ms);
            job
        };
        // In the order of their ids, which is that of their arrival.
        let jobs = [
            ended_at(JobState::Running, None),
            ended_at(JobState::Queued, None),
            ended_at(JobState::Failed, Some(500)),
            ended_at(JobState::Succeeded, Some(10)),
            ended_at(JobState::Cancelled, Some(500)),
        ];
        catalogue.commit(jobs.iter().cloned().map(Change::InsertJob).collect()).await.unwrap();
        let left = async || {
            let listed = catalogue.jobs(None, &first(9)).await.unwrap().records;
            let place = |id: &str| jobs.iter().position(|job| job.id == id).unwrap();
            listed.iter().rev().map(|job| place(&job.id)).collect::<Vec<_>>()
        };
        let prune = |before_ms, keep_newest| vec![Change::PruneEndedJobs { before_ms, keep_newest }];
        catalogue.commit(prune(100, 100)).await.unwrap();
        assert_eq!(left().await, [0, 1, 2, 4], "by age");
        catalogue.commit(prune(100, 1)).await.unwrap();
        assert_eq!(left().await, [0, 1, 4], "by number");
    }
}
