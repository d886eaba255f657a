//! Order, ends, limits and restarts, with a procedure that acts according to the job's name.

use crate::events::{EmptyBody, Event, event};
use parking_lot::Mutex;
use std::sync::atomic::AtomicBool;

use serde_json::json;
use station::Manual;
use store::{ArtifactId, CaptureRecord, Change, EventRecord, JobOutcome, JobRecord, Page, ResultRef};

use super::*;
use crate::access::lease::Authority;
use crate::error::{AppError, ErrorKind};
use crate::jobs::progress::Phase;
use crate::jobs::queue::run::Procedure;
use crate::jobs::{CalibrateInput, Done, JobEnd, JobInput, JobNews, Source, StationContext, queued_record};

/// The log of the jobs of a test, and whether they may end.
#[derive(Default)]
struct Script {
    began: Mutex<Vec<String>>,
    released: AtomicBool,
}

impl Script {
    fn procedure(self: &Arc<Self>) -> Procedure {
        let script = self.clone();
        Arc::new(move |input, ctx| script.play(&input, ctx))
    }

    fn play(&self, input: &JobInput, ctx: &StationContext) -> Result<Done, JobEnd> {
        let name = name_of(input);
        self.began.lock().push(name.clone());
        match name.as_str() {
            "panic" => panic!("on purpose"),
            "fail" => return Err(AppError::new(ErrorKind::Impossible, "it cannot be").into()),
            "reports" => {
                for (fraction, words) in [(0.5, "half"), (0.2, "back"), (f64::NAN, "lost"), (0.7, "on")] {
                    ctx.report(fraction, Phase::CapturingRows.counted(3, 4), words);
                }
            }
            _ => {}
        }
        while !self.released.load(Ordering::SeqCst) {
            ctx.check_cancelled()?;
            std::thread::sleep(Duration::from_millis(2));
        }
        let id = if name == "twice" { "a".to_owned() } else { format!("made by {name}") };
        let changes = vec![event(&id, Event::DoorRecovered(EmptyBody {})), Change::InsertCapture(capture(&id))];
        let result = ResultRef { kind: "capture".to_owned(), id };
        let done = Done { result, message: "made".to_owned(), changes, finished_work: None };
        if name == "half" { Err(JobEnd::CancelledAfter(Box::new(done))) } else { Ok(done) }
    }

    fn release(&self) {
        self.released.store(true, Ordering::SeqCst);
    }

    fn began(&self) -> Vec<String> {
        self.began.lock().clone()
    }
}

fn name_of(input: &JobInput) -> String {
    match input {
        JobInput::Calibration(CalibrateInput { source: Source::Station, n_poses: Some(n_poses), .. }) => {
            format!("s{}", n_poses / 10)
        }
        JobInput::Calibration(CalibrateInput { source: Source::Capture { capture_id }, .. }) => capture_id.clone(),
        other => panic!("{other:?} is not played here"),
    }
}

/// A station job, named `s1` to `s9` by its number of poses.
fn station_job(name: &str) -> JobInput {
    let JobInput::Calibration(other) = computation("") else { unreachable!() };
    let n_poses = 10 * name[1..].parse::<usize>().unwrap_or(0).max(1);
    JobInput::Calibration(CalibrateInput { source: Source::Station, n_poses: Some(n_poses), ..other })
}

/// A computation.
fn computation(name: &str) -> JobInput {
    JobInput::Calibration(CalibrateInput {
        source: Source::Capture { capture_id: name.to_owned() },
        light_model: None,
        k3: None,
        leave_out_unreadable: false,
        n_poses: None,
        session_id: None,
        station: None,
    })
}

fn capture(id: &str) -> CaptureRecord {
    CaptureRecord {
        id: id.to_owned(),
        name: id.to_owned(),
        origin: "upload".to_owned(),
        archive: ArtifactId::parse(&"0".repeat(64)).unwrap(),
        archive_format: "zip".to_owned(),
        size_bytes: 1,
        summary: json!({}),
        created_at_ms: 0,
    }
}

async fn stage() -> (Bench, Jobs, Arc<Script>) {
    let bench = Bench::new(&small()).await;
    let captures =
        ["a", "b", "half", "panic", "fail", "reports", "twice"].map(|id| Change::InsertCapture(capture(id)));
    bench.parts.catalogue.commit(captures.to_vec()).await.unwrap();
    let script = Arc::new(Script::default());
    let jobs = Jobs::start_with(bench.parts.clone(), script.procedure()).await.unwrap();
    (bench, jobs, script)
}

async fn submit(jobs: &Jobs, input: JobInput) -> String {
    jobs.submit(input, "test").await.unwrap().id
}

async fn events(bench: &Bench, subject: &str) -> Vec<EventRecord> {
    let all = bench.parts.catalogue.read().events_after(0, 1000).await.unwrap().records;
    all.into_iter().filter(|event| event.subject == subject).collect()
}

async fn event_kinds(bench: &Bench, subject: &str) -> Vec<String> {
    events(bench, subject).await.into_iter().map(|event| event.kind).collect()
}

/// A client notified of the end reads the job at once, possibly before late progress of the job's thread arrives.
#[tokio::test(flavor = "multi_thread")]
async fn a_stored_end_is_not_overwritten_by_late_progress() {
    let (bench, jobs, script) = stage().await;
    let id = submit(&jobs, computation("a")).await;
    let before = running(&jobs, &id).await;
    let end =
        Change::EndJob { id: id.clone(), outcome: JobOutcome::Cancelled, message: "stored".to_owned(), at_ms: 1 };
    bench.parts.catalogue.commit(vec![end]).await.unwrap();
    let view = jobs.view(&id).await.unwrap();
    assert_eq!((view.record.state, view.record.message.as_str()), (JobState::Cancelled, "stored"));
    let page = Page { before: None, limit: 10 };
    assert_eq!(jobs.list(None, &page).await.unwrap().records[0].record.state, JobState::Cancelled);

    let progress = jobs.watch_progress();
    jobs.0.publish(view);
    jobs.0.publish(before.clone());
    assert_eq!(newest(&progress).record.state, JobState::Cancelled);
    let other = JobView { record: JobRecord { id: "another".to_owned(), ..before.record }, ..before };
    jobs.0.publish(other);
    assert_eq!(newest(&progress).record.id, "another");
    script.release();
}

/// The newest progress.
fn newest(progress: &tokio::sync::watch::Receiver<JobNews>) -> JobView {
    let news = progress.borrow();
    news.after(news.last() - 1).unwrap().1.clone()
}

/// A scan and a concurrent computation: a slow reader sees both, not only the one that reported last.
#[test]
fn the_progress_of_one_job_never_hides_that_of_another() {
    let view = |id: &str, progress: f64, state: JobState| {
        let record = queued_record(&computation("a"), "test").unwrap();
        JobView::from(JobRecord { id: id.to_owned(), progress, state, ..record })
    };
    let mut news = JobNews::default();
    for progress in [0.1, 0.2, 0.3] {
        assert!(news.publish(view("scan", progress, JobState::Running)));
        assert!(news.publish(view("export", progress, JobState::Running)));
    }
    let (first, of_scan) = news.after(0).unwrap();
    assert_eq!((of_scan.record.id.as_str(), of_scan.record.progress), ("scan", 0.3));
    let (second, of_export) = news.after(first).unwrap();
    assert_eq!((of_export.record.id.as_str(), of_export.record.progress), ("export", 0.3));
    assert!(news.after(second).is_none());
    // An end stays final.
    assert!(news.publish(view("scan", 1.0, JobState::Succeeded)));
    assert!(!news.publish(view("scan", 0.4, JobState::Running)));
    assert_eq!(news.after(second).unwrap().1.record.state, JobState::Succeeded);
    // The running job is kept however many others end.
    for ended in 0..100 {
        news.publish(view(&format!("ended {ended}"), 1.0, JobState::Succeeded));
    }
    assert_eq!(news.after(0).unwrap().1.record.id, "export");
}

#[tokio::test(flavor = "multi_thread")]
async fn station_jobs_run_one_at_a_time_in_order_and_computations_in_parallel() {
    let (_bench, jobs, script) = stage().await;
    let mut ids = Vec::new();
    for input in [station_job("s1"), station_job("s2"), computation("a"), computation("b"), station_job("s3")] {
        ids.push(submit(&jobs, input).await);
    }
    running(&jobs, &ids[0]).await;
    running(&jobs, &ids[2]).await;
    for waiting in [1, 3, 4] {
        assert_eq!(jobs.view(&ids[waiting]).await.unwrap().record.state, JobState::Queued);
    }
    script.release();
    for id in &ids {
        assert_eq!(ended(&jobs, id).await.record.state, JobState::Succeeded);
    }
    let station: Vec<String> = script.began().into_iter().filter(|name| name.starts_with('s')).collect();
    assert_eq!(station, ["s1", "s2", "s3"]);
    let computed: Vec<String> = script.began().into_iter().filter(|name| !name.starts_with('s')).collect();
    assert_eq!(computed, ["a", "b"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_can_be_cancelled_in_every_state() {
    let (bench, jobs, script) = stage().await;
    let first = submit(&jobs, station_job("s1")).await;
    let second = submit(&jobs, station_job("s2")).await;
    running(&jobs, &first).await;
    // Waiting: it ends at once and never starts.
    let view = jobs.cancel(&second, "Anna").await.unwrap();
    assert_eq!(view.record.state, JobState::Cancelled);
    assert!(view.record.message.contains("Anna"));
    // Running: it is asked to end and does.
    jobs.cancel(&first, "Anna").await.unwrap();
    assert_eq!(ended(&jobs, &first).await.record.state, JobState::Cancelled);
    assert_eq!(script.began(), ["s1"]);
    // Ended: nothing changes.
    let before = event_kinds(&bench, &first).await;
    assert_eq!(jobs.cancel(&first, "Anna").await.unwrap().record.state, JobState::Cancelled);
    assert_eq!(event_kinds(&bench, &first).await, before);
    assert_eq!(before, ["job.queued", "job.running", "job.cancelled"]);
    assert_eq!(jobs.cancel("nobody", "Anna").await.unwrap_err().kind, ErrorKind::NotFound);
}

#[tokio::test(flavor = "multi_thread")]
async fn stop_ends_the_station_jobs_and_leaves_computations_alone() {
    let (_bench, jobs, script) = stage().await;
    let mut ids = Vec::new();
    for input in [station_job("s1"), station_job("s2"), computation("a")] {
        ids.push(submit(&jobs, input).await);
    }
    running(&jobs, &ids[0]).await;
    running(&jobs, &ids[2]).await;
    let cleared = jobs.clear_station_jobs();
    assert_eq!(cleared.len(), 1, "the queue is empty before anything is awaited");
    jobs.end_cleared_jobs(cleared, "Bert", Vec::new()).await.unwrap();
    assert_eq!(ended(&jobs, &ids[0]).await.record.state, JobState::Cancelled);
    assert_eq!(jobs.view(&ids[1]).await.unwrap().record.state, JobState::Cancelled);
    assert_eq!(jobs.view(&ids[2]).await.unwrap().record.state, JobState::Running);
    script.release();
    assert_eq!(ended(&jobs, &ids[2]).await.record.state, JobState::Succeeded);
    let next = submit(&jobs, station_job("s3")).await;
    assert_eq!(ended(&jobs, &next).await.record.state, JobState::Succeeded);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stopped_station_accepts_no_job_and_a_job_accepted_during_a_stop_never_starts() {
    let (bench, jobs, script) = stage().await;
    let station = &bench.parts.station;
    let before = Authority { holder: None, epoch: station.stop_epoch() };
    station.stop("Bert").await.unwrap();
    let refused = jobs.submit(station_job("s1"), "test").await.unwrap_err();
    assert_eq!(refused.kind, ErrorKind::Halted);
    assert!(refused.remedy.is_some());
    station.manual(Manual::Reset).await.unwrap();
    script.release();
    // Authorised before the Stop, accepted after the reset: it must not be queued.
    let late = jobs.submit_with(station_job("s2"), "test", before, |_| Vec::new()).await.unwrap().id;
    assert_eq!(ended(&jobs, &late).await.record.state, JobState::Cancelled);
    let next = submit(&jobs, station_job("s3")).await;
    assert_eq!(ended(&jobs, &next).await.record.state, JobState::Succeeded);
    assert_eq!(script.began(), ["s3"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_waits_while_someone_else_is_in_control() {
    let (bench, jobs, script) = stage().await;
    script.release();
    let control = &bench.parts.control;
    let anna = control.take("Anna", false, Instant::now()).unwrap().lease.id;
    let unattended = submit(&jobs, station_job("s1")).await;
    assert_eq!(jobs.view(&unattended).await.unwrap().record.state, JobState::Queued);
    assert!(script.began().is_empty());
    control.give_back(Some(&anna));
    jobs.recheck_control();
    assert_eq!(ended(&jobs, &unattended).await.record.state, JobState::Succeeded);
    let anna = control.take("Anna", false, Instant::now()).unwrap().lease.id;
    let epoch = bench.parts.station.stop_epoch();
    let hers = control.authority(Some(&anna), epoch, Instant::now());
    let id = jobs.submit_with(station_job("s2"), "Anna", hers, |_| Vec::new()).await.unwrap().id;
    assert_eq!(ended(&jobs, &id).await.record.state, JobState::Succeeded);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_fails_one_job_only() {
    let (_bench, jobs, script) = stage().await;
    script.release();
    let broken = submit(&jobs, computation("panic")).await;
    let failed = submit(&jobs, computation("fail")).await;
    let good = submit(&jobs, computation("a")).await;
    let broken = ended(&jobs, &broken).await.record;
    assert_eq!((broken.state, &broken.problem.unwrap()["kind"]), (JobState::Failed, &json!("internal")));
    let failed = ended(&jobs, &failed).await.record;
    assert_eq!((failed.state, &failed.problem.unwrap()["detail"]), (JobState::Failed, &json!("it cannot be")));
    assert_eq!(ended(&jobs, &good).await.record.state, JobState::Succeeded);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_ends_together_with_its_results_or_has_none() {
    let (bench, jobs, script) = stage().await;
    script.release();
    let good = submit(&jobs, computation("b")).await;
    let record = ended(&jobs, &good).await.record;
    assert_eq!(record.result.unwrap().id, "made by b");
    bench.parts.catalogue.read().capture("made by b").await.unwrap();
    assert_eq!(event_kinds(&bench, &good).await, ["job.queued", "job.running", "job.succeeded"]);
    // Cancelled after it had produced a result: kept with the end.
    let half = submit(&jobs, computation("half")).await;
    let record = ended(&jobs, &half).await.record;
    assert_eq!((record.state, record.result), (JobState::Cancelled, None));
    bench.parts.catalogue.read().capture("made by half").await.unwrap();
    // Its capture already exists: the whole end is refused, including its event.
    let twice = submit(&jobs, computation("twice")).await;
    let record = ended(&jobs, &twice).await.record;
    assert_eq!((record.state, record.result), (JobState::Failed, None));
    assert!(events(&bench, "a").await.iter().all(|event| event.kind != "capture.deleted"));
    assert_eq!(bench.parts.catalogue.read().job(&twice).await.unwrap().state, JobState::Failed);
}

#[tokio::test(flavor = "multi_thread")]
async fn progress_never_decreases_and_a_running_job_names_its_step() {
    let (_bench, jobs, script) = stage().await;
    let mut watched = jobs.watch_progress();
    let id = submit(&jobs, computation("reports")).await;
    let begun = Instant::now();
    let mut fractions = Vec::new();
    while fractions.last() != Some(&1.0) {
        assert!(begun.elapsed() < PATIENCE);
        watched.changed().await.unwrap();
        watched.mark_unchanged();
        let view = newest(&watched);
        fractions.push(view.record.progress);
        if view.record.message == "on" {
            assert_eq!(view.record.progress, 0.7);
            assert_eq!(view.step.is_some(), view.record.state == JobState::Running);
            assert!(view.step.is_none_or(|step| step == Phase::CapturingRows.counted(3, 4)));
            script.release();
        }
    }
    assert!(fractions.windows(2).all(|pair| pair[0] <= pair[1]), "{fractions:?}");
    let view = ended(&jobs, &id).await;
    assert_eq!((view.record.message.as_str(), view.step), ("made", None));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_refuses_and_says_when_to_retry() {
    let (_bench, jobs, script) = stage().await;
    let first = submit(&jobs, station_job("s")).await;
    running(&jobs, &first).await;
    for _ in 0..crate::jobs::queue::params::QUEUE_LIMIT {
        submit(&jobs, station_job("s")).await;
    }
    let refused = jobs.submit(computation("a"), "test").await.unwrap_err();
    assert_eq!(refused.kind, ErrorKind::TooMany);
    assert!(refused.retry_after_s.is_some());
    jobs.end_cleared_jobs(jobs.clear_station_jobs(), "test", Vec::new()).await.unwrap();
    script.release();
    jobs.submit(computation("a"), "test").await.unwrap();
    jobs.shut_down().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_without_enough_disk_space_is_not_started() {
    let (bench, jobs, script) = stage().await;
    bench.free_bytes.store(1 << 20, Ordering::SeqCst);
    let refused = jobs.submit(station_job("s"), "test").await.unwrap_err();
    assert_eq!(refused.kind, ErrorKind::StorageFull);
    assert!(script.began().is_empty());
    let page = Page { before: None, limit: 10 };
    assert!(jobs.list(None, &page).await.unwrap().records.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_input_is_refused_before_it_is_queued() {
    let (_bench, jobs, _script) = stage().await;
    let missing = jobs.submit(computation("nowhere"), "test").await.unwrap_err();
    assert_eq!((missing.kind, missing.pointer.as_deref()), (ErrorKind::Impossible, Some("/source/capture_id")));
    let JobInput::Calibration(good) = computation("a") else { unreachable!() };
    let model = CalibrateInput { light_model: Some("magic".to_owned()), ..good.clone() };
    let refused = jobs.submit(JobInput::Calibration(model), "test").await.unwrap_err();
    assert_eq!((refused.kind, refused.pointer.as_deref()), (ErrorKind::Impossible, Some("/light_model")));
    let poses = CalibrateInput { n_poses: Some(2), ..good };
    assert_eq!(jobs.submit(JobInput::Calibration(poses), "test").await.unwrap_err().kind, ErrorKind::Impossible);
}

/// The catalogue as left by a crashed process: one job running, one of each kind waiting.
#[tokio::test(flavor = "multi_thread")]
async fn after_a_crash_computations_continue_and_nothing_moves() {
    let (bench, jobs, script) = stage().await;
    let mut ids = Vec::new();
    for input in [station_job("s1"), station_job("s2"), computation("a"), computation("b")] {
        ids.push(submit(&jobs, input).await);
    }
    running(&jobs, &ids[0]).await;
    running(&jobs, &ids[2]).await;
    // The queue is gone; its threads can store nothing more, because their jobs have ended.
    bench.store.recover(0).await.unwrap();
    let reborn = Arc::new(Script::default());
    reborn.release();
    let later = Jobs::start_with(bench.parts.clone(), reborn.procedure()).await.unwrap();
    assert_eq!(ended(&later, &ids[3]).await.record.state, JobState::Succeeded);
    for dead in [0, 1, 2] {
        assert_eq!(later.view(&ids[dead]).await.unwrap().record.state, JobState::Interrupted, "{dead}");
        assert_eq!(event_kinds(&bench, &ids[dead]).await.last().unwrap(), "job.interrupted");
    }
    assert_eq!(reborn.began(), ["b"]);
    script.release();
    ended(&jobs, &ids[0]).await;
    let stored = bench.parts.catalogue.read().job(&ids[0]).await.unwrap();
    assert_eq!((stored.state, stored.result), (JobState::Interrupted, None));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_shutdown_interrupts_the_running_job_and_keeps_waiting_ones() {
    let (bench, jobs, script) = stage().await;
    let first = submit(&jobs, computation("a")).await;
    let second = submit(&jobs, computation("b")).await;
    running(&jobs, &first).await;
    jobs.shut_down().await;
    assert_eq!(bench.parts.catalogue.read().job(&first).await.unwrap().state, JobState::Interrupted);
    assert_eq!(bench.parts.catalogue.read().job(&second).await.unwrap().state, JobState::Queued);
    assert_eq!(script.began(), ["a"]);
    assert_eq!(jobs.submit(computation("a"), "test").await.unwrap_err().kind, ErrorKind::Unavailable);
}

/// The store refuses a second end.
#[tokio::test(flavor = "multi_thread")]
async fn a_job_ends_once() {
    let (bench, jobs, script) = stage().await;
    script.release();
    let id = submit(&jobs, computation("a")).await;
    ended(&jobs, &id).await;
    let end = Change::EndJob { id, outcome: JobOutcome::Cancelled, message: String::new(), at_ms: 0 };
    assert!(bench.parts.catalogue.commit(vec![end]).await.is_err());
}
