use std::future::poll_fn;
use std::task::Poll;

use serde_json::json;
use store::{Change, JobOutcome, JobState, ResultRef, SettingRecord};

use super::stores;
use crate::common::{activate, calibration, capture, event, first, idempotency, job, measurement, scan, session};

#[tokio::test]
async fn a_refused_change_rolls_back_the_whole_commit() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let job = job();
        let changes = vec![
            Change::InsertJob(job.clone()),
            Change::AppendEvent(event(&job.id)),
            Change::StartJob { id: job.id.clone(), at_ms: 1 },
            Change::StartJob { id: job.id.clone(), at_ms: 2 },
        ];
        catalogue.commit(changes).await.unwrap_err();
        assert!(catalogue.job(&job.id).await.is_err());
        assert_eq!(catalogue.last_event_seq().await.unwrap(), 0);
        assert!(catalogue.commit(Vec::new()).await.unwrap().is_empty());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn many_tasks_commit_at_once_and_every_event_has_its_own_number() {
    const N_TASKS: usize = 16;
    const N_COMMITS: usize = 10;
    for fresh in stores().await {
        let tasks: Vec<_> = (0..N_TASKS)
            .map(|_| {
                let catalogue = fresh.store.catalogue.clone();
                tokio::spawn(async move {
                    for _ in 0..N_COMMITS {
                        let job = job();
                        let changes = vec![Change::InsertJob(job.clone()), Change::AppendEvent(event(&job.id))];
                        let stored = catalogue.commit(changes).await.unwrap();
                        assert_eq!(stored[0].subject, job.id);
                        assert_eq!(catalogue.job(&job.id).await.unwrap(), job, "what is committed is read");
                    }
                })
            })
            .collect();
        for task in tasks {
            task.await.unwrap();
        }
        let events = fresh.store.catalogue.events_after(0, 1_000).await.unwrap().records;
        let seqs: Vec<_> = events.iter().map(|event| event.seq).collect();
        assert_eq!(seqs, (1..=(N_TASKS * N_COMMITS) as i64).collect::<Vec<_>>());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_of_many_starts_the_job_and_one_ends_it() {
    for fresh in stores().await {
        let job = job();
        fresh.store.catalogue.commit(vec![Change::InsertJob(job.clone())]).await.unwrap();
        let start = Change::StartJob { id: job.id.clone(), at_ms: 1 };
        let end = Change::EndJob {
            id: job.id.clone(),
            outcome: JobOutcome::Cancelled,
            message: String::new(),
            at_ms: 2,
        };
        for change in [start, end] {
            let tries: Vec<_> = (0..12)
                .map(|_| {
                    let (catalogue, change) = (fresh.store.catalogue.clone(), change.clone());
                    tokio::spawn(async move { catalogue.commit(vec![change]).await.is_ok() })
                })
                .collect();
            let mut n_won = 0;
            for won in tries {
                n_won += usize::from(won.await.unwrap());
            }
            assert_eq!(n_won, 1);
        }
        assert_eq!(fresh.store.catalogue.job(&job.id).await.unwrap().state, JobState::Cancelled);
    }
}

#[tokio::test]
async fn a_commit_whose_caller_goes_away_is_whole_and_blocks_nobody() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        for n_polls in 0..20 {
            let (job, other) = (job(), job());
            let mut commit = catalogue.commit(vec![
                Change::InsertJob(job.clone()),
                Change::InsertJob(other.clone()),
                Change::AppendEvent(event(&job.id)),
            ]);
            for _ in 0..n_polls {
                let ready = poll_fn(|cx| Poll::Ready(commit.as_mut().poll(cx).is_ready())).await;
                if ready {
                    break;
                }
                tokio::task::yield_now().await;
            }
            drop(commit);
            let after = catalogue.commit(vec![Change::AppendEvent(event("after"))]).await.unwrap();
            assert_eq!(after[0].subject, "after");
            assert_eq!(catalogue.job(&job.id).await.is_ok(), catalogue.job(&other.id).await.is_ok());
        }
        assert!(catalogue.jobs(None, &first(100)).await.unwrap().records.len() <= 40);
    }
}

#[tokio::test]
async fn the_last_value_of_a_setting_is_returned() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        assert_eq!(catalogue.setting("camera").await.unwrap(), None);
        for value in [serde_json::json!({"exposure_us": 500.0}), serde_json::json!(null)] {
            let setting = SettingRecord { name: "camera".to_owned(), value, changed_at_ms: 7 };
            catalogue.commit(vec![Change::PutSetting(setting.clone())]).await.unwrap();
            assert_eq!(catalogue.setting("camera").await.unwrap(), Some(setting));
        }
    }
}

#[tokio::test]
async fn a_key_is_noted_before_its_answer_and_free_again_after_a_refusal() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        let mut noted = idempotency("k", 5);
        noted.answer = serde_json::Value::Null;
        catalogue.commit(vec![Change::InsertIdempotency(noted.clone())]).await.unwrap();
        let answered = |answer| vec![Change::AnswerIdempotency { key: "k".to_owned(), answer }];
        catalogue.commit(answered(Some(serde_json::json!({"status": 200})))).await.unwrap();
        noted.answer = serde_json::json!({"status": 200});
        assert_eq!(catalogue.idempotency("k").await.unwrap(), Some(noted));
        catalogue.commit(answered(None)).await.unwrap();
        assert_eq!(catalogue.idempotency("k").await.unwrap(), None);
    }
}

#[test]
fn changes_survive_serialisation_between_processes() {
    let job = job();
    let result = ResultRef { kind: "scan".into(), id: "s".into() };
    let setting = SettingRecord { name: "station.halted".into(), value: json!(true), changed_at_ms: 1 };
    let end = |outcome| Change::EndJob { id: job.id.clone(), outcome, message: "ended".into(), at_ms: 3 };
    let changes = vec![
        Change::InsertJob(job.clone()),
        end(JobOutcome::Succeeded(result)),
        end(JobOutcome::Failed(json!({ "kind": "internal" }))),
        Change::InsertCapture(capture()),
        Change::InsertCalibration(calibration("c1")),
        Change::InsertScan(scan("c1")),
        Change::InsertMeasurement(measurement("s")),
        Change::InsertSession(session()),
        Change::PutSetting(setting),
        Change::AppendEvent(event("s")),
        // Any calibration and none are not the same.
        activate(Some("c1"), None),
        activate(Some("c1"), Some(None)),
        activate(None, Some(Some("c1"))),
    ];
    let text = serde_json::to_string(&changes).unwrap();
    assert_eq!(serde_json::from_str::<Vec<Change>>(&text).unwrap(), changes);
    // What names no artifact does not come in this way.
    let forged = text.replace(capture().archive.as_str(), "../catalogue.sqlite3");
    assert!(serde_json::from_str::<Vec<Change>>(&forged).is_err());
}
