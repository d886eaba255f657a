//! One continuous scan of the whole recording, and its measurements.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use store::{JobState, ScanRecord};

use crate::arguments::BenchServerArgs;
use crate::commands::bench::server::failure_of;
use crate::commands::bench::server::load::{SCAN, STEP_MM};
use crate::commands::bench::server::threads::{Work, between, by_name};
use app::App;
use app::jobs::{JobInput, ScanInput, ScanMode, ScanSource};
use app::lease::Authority;
use app::measurements::ScanPurpose;
use app::scan_run::ScanSettings;
use pipeline::{Failure, FailureKind};

/// Begin and end of the measured part of a sweep, as fractions of its frames: after the first frames, which allocate
/// memory, and before the end.
const MEASURED_PART: [f64; 2] = [0.25, 0.9];
/// Period of polling the progress: that of the station's status.
const POLL_PERIOD: Duration = Duration::from_millis(50);
/// Period of polling the state of the job, which reads the database.
const JOB_POLL_PERIOD: Duration = Duration::from_millis(500);

/// Result of a sweep.
pub struct SweepResult {
    state: String,
    n_frames: u64,
    n_points: u64,
    timing: Value,
    losses: Vec<String>,
    dropped: BTreeMap<String, u64>,
    /// Figures of the measured part.
    measured: Measured,
}

struct Measured {
    n_frames: u64,
    took_s: f64,
    n_messages: u64,
    work: BTreeMap<String, Work>,
}

/// Runs one scan.
pub async fn sweep(app: &App, args: &BenchServerArgs, received: &AtomicU64) -> Result<SweepResult, Failure> {
    let input = ScanInput {
        source: ScanSource::Station,
        name: Some(SCAN.to_owned()),
        settings: ScanSettings {
            from_mm: Some(0.0),
            to_mm: Some((args.frames - 1) as f64 * STEP_MM),
            speed_mm_s: Some(STEP_MM * args.rate_hz),
            mode: Some(ScanMode::Continuous),
            ..ScanSettings::default()
        },
        calibration_id: None,
        resume_scan_id: None,
        measure: Vec::new(),
        purpose: ScanPurpose::Production,
    };
    let (arrived, dropped_before) = counts(app);
    let authority = Authority { holder: None, epoch: app.station.stop_epoch() };
    let job = app
        .jobs
        .submit_with(JobInput::Scan(input), "bench", authority, |_| Vec::new())
        .await
        .map_err(failure_of)?;
    let at = |fraction: f64| arrived + (args.frames as f64 * fraction) as u64;
    reached(app, &job.id, at(MEASURED_PART[0])).await?;
    let (began, frames_before, work_before, received_before) =
        (Instant::now(), counts(app).0, by_name(), received.load(Ordering::Relaxed));
    reached(app, &job.id, at(MEASURED_PART[1])).await?;
    let measured = Measured {
        n_frames: counts(app).0 - frames_before,
        took_s: began.elapsed().as_secs_f64(),
        n_messages: received.load(Ordering::Relaxed) - received_before,
        work: between(&work_before, &by_name()),
    };
    let scan = ended(app, &job.id).await?;
    let dropped = counts(app).1.into_iter().map(|(reason, n)| {
        let before = dropped_before.get(&reason).copied().unwrap_or(0);
        (reason, n - before)
    });
    let text_of = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    Ok(SweepResult {
        state: format!("{:?}", scan.state),
        n_frames: scan.report["n_frames"].as_u64().unwrap_or(0),
        n_points: scan.report["n_points"].as_u64().unwrap_or(0),
        timing: scan.report["timing"].clone(),
        losses: scan.report["losses"].as_array().into_iter().flatten().map(text_of).collect(),
        dropped: dropped.collect(),
        measured,
    })
}

/// Number of frames that arrived, and of dropped ones by reason. The status is at most 0.1 s old.
fn counts(app: &App) -> (u64, BTreeMap<String, u64>) {
    let status = app.station.status();
    let dropped = status.frames_dropped.iter().map(|(reason, n)| ((*reason).to_owned(), *n));
    (status.frames_arrived, dropped.collect())
}

/// Waits until `n_frames` have arrived or the job has ended.
async fn reached(app: &App, job: &str, n_frames: u64) -> Result<(), Failure> {
    let mut asked_at = Instant::now();
    while counts(app).0 < n_frames {
        tokio::time::sleep(POLL_PERIOD).await;
        if asked_at.elapsed() >= JOB_POLL_PERIOD {
            asked_at = Instant::now();
            let state = app.jobs.view(job).await.map_err(failure_of)?.record.state;
            if !matches!(state, JobState::Queued | JobState::Running) {
                return Ok(());
            }
        }
    }
    Ok(())
}

async fn ended(app: &App, job: &str) -> Result<ScanRecord, Failure> {
    loop {
        let record = app.jobs.view(job).await.map_err(failure_of)?.record;
        match (record.state, record.result) {
            (JobState::Succeeded, Some(result)) => {
                return app.catalogue.read().scan(&result.id).await.map_err(|error| failure_of(error.into()));
            }
            (JobState::Queued | JobState::Running, _) => {}
            (state, _) => {
                let problem = record.problem.map(|problem| problem.to_string()).unwrap_or_default();
                return Err(Failure::new(FailureKind::Internal, format!("the scan ended {state:?}: {problem}")));
            }
        }
        tokio::time::sleep(JOB_POLL_PERIOD).await;
    }
}

impl SweepResult {
    /// Appends the result as text.
    pub fn write_to(&self, text: &mut String) {
        let ms = |which: &str, what: &str| self.timing[which][what].as_f64().unwrap_or(f64::NAN);
        let _ = writeln!(
            text,
            "{:.0} frames/s of {} frames, {} points each, scan {}; lost {}",
            self.timing["frames_per_s"].as_f64().unwrap_or(f64::NAN),
            self.n_frames,
            self.n_points / self.n_frames.max(1),
            self.state.to_lowercase(),
            self.dropped.iter().map(|(reason, n)| format!("{reason} {n}")).collect::<Vec<_>>().join(", ")
        );
        for loss in &self.losses {
            let _ = writeln!(text, "  {loss}");
        }
        for (which, label) in [
            ("arrival_to_profile_ms", "arrival → profile on the bus"),
            ("arrival_to_file_ms", "arrival → peaks written"),
        ] {
            let _ = writeln!(
                text,
                "  {label}: p50 {:.2} ms, p99 {:.2} ms, max {:.2} ms",
                ms(which, "p50"),
                ms(which, "p99"),
                ms(which, "max")
            );
        }
        let measured = &self.measured;
        let _ = writeln!(
            text,
            "  viewers received {:.1} profiles per second",
            measured.n_messages as f64 / measured.took_s
        );
        for (name, work) in measured.work.iter().filter(|(_, work)| work.cpu_ms > 0.0 || work.allocations > 0) {
            let _ = writeln!(
                text,
                "  {name:<16} {:6.3} ms of CPU time and {:7.3} allocations per frame",
                work.cpu_ms / measured.n_frames.max(1) as f64,
                work.allocations as f64 / measured.n_frames.max(1) as f64
            );
        }
        let cpu_ms: f64 = measured.work.values().map(|work| work.cpu_ms).sum();
        let _ = writeln!(
            text,
            "  total {:.3} ms per frame: {:.2} cores",
            cpu_ms / measured.n_frames.max(1) as f64,
            cpu_ms / 1e3 / measured.took_s
        );
    }

    /// The result as JSON.
    pub fn to_json(&self) -> Value {
        let per_frame = |value: f64| value / self.measured.n_frames.max(1) as f64;
        let threads: serde_json::Map<String, Value> = self
            .measured
            .work
            .iter()
            .map(|(name, work)| {
                let row = json!({
                    "cpu_ms_per_frame": per_frame(work.cpu_ms),
                    "allocations_per_frame": per_frame(work.allocations as f64),
                });
                (name.clone(), row)
            })
            .collect();
        json!({
            "state": self.state, "n_frames": self.n_frames, "n_points": self.n_points, "timing": self.timing,
            "losses": self.losses, "dropped": self.dropped, "threads": threads,
            "allocations_counted": crate::heap::allocations::COUNTED,
            "profiles_per_s": self.measured.n_messages as f64 / self.measured.took_s,
        })
    }
}
