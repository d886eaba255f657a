//! `sheaf bench server`: the whole service on this machine, from the camera to the disk and the viewers.

mod load;
mod sweep;
mod threads;
pub mod viewer;

use std::fmt::Write as _;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::json;
use store::{CalibrationRecord, Change};
use tokio::net::TcpListener;
use tokio::sync::oneshot;

use crate::arguments::{BenchServerArgs, SettingsArgs};
use crate::commands::Answer;
use crate::commands::service::config::effective_of;
use crate::service;
use app::App;
use app::error::{AppError, ErrorKind};
use pipeline::Reporter;
use pipeline::read_document;
use pipeline::{Failure, FailureKind};
use station::wall_clock::now_ms;
use sweep::SweepResult;
use viewer::Viewer;

/// Longest time from the start until the station is ready: every image is decoded once.
const READY_WITHIN: Duration = Duration::from_secs(300);

/// Runs the benchmark.
pub fn server(args: &BenchServerArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let folder = tempfile::tempdir_in(&args.folder).map_err(|cause| Failure::unwritable(&args.folder, &cause))?;
    let recording = folder.path().join("recording");
    std::fs::create_dir(&recording).map_err(|cause| Failure::unwritable(&recording, &cause))?;
    let n_images = load::write_load(&args.capture, args.frames, &recording)?;
    reporter.note(&format!(
        "{} frames of {n_images} different images, {} sweeps, {} viewers",
        args.frames, args.sweeps, args.viewers
    ));
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .thread_name("serve")
        .build()
        .map_err(|cause| Failure::new(FailureKind::Internal, "no threads can be started").because(&cause))?;
    let swept = runtime.block_on(measured(args, folder.path(), &recording));
    runtime.shutdown_timeout(service::SHUTDOWN_LIMIT / 5);
    Ok(answer(args, n_images, &swept?))
}

async fn measured(args: &BenchServerArgs, folder: &Path, recording: &Path) -> Result<Vec<SweepResult>, Failure> {
    let set = |key: &str, value: String| format!("station.{key}={value}");
    let config = effective_of(&SettingsArgs {
        listen: Some("127.0.0.1:0".to_owned()),
        data: Some(folder.join("data")),
        config: None,
        set: vec![
            set("camera.kind", "replay".to_owned()),
            set("stage.kind", "replay".to_owned()),
            set("laser.kind", "replay".to_owned()),
            set("replay.folder", recording.display().to_string()),
            set("replay.frame_rate_hz", args.rate_hz.to_string()),
        ],
    })?;
    let no_port = |cause: std::io::Error| Failure::new(FailureKind::Internal, "no free port").because(&cause);
    let listener = TcpListener::bind(config.config.listen).await.map_err(no_port)?;
    let address = listener.local_addr().map_err(no_port)?;
    let running = service::assemble(config.config).await?;
    let app = running.app.clone();
    let (end, ended) = oneshot::channel::<()>();
    let serving = tokio::spawn(service::run(running, listener, async { drop(ended.await) }));
    let swept = with_viewers(args, &app, address).await;
    drop(end);
    let _ = serving.await;
    swept
}

async fn with_viewers(
    args: &BenchServerArgs,
    app: &App,
    address: SocketAddr,
) -> Result<Vec<SweepResult>, Failure> {
    activate(app, &args.calibration).await.map_err(failure_of)?;
    ready(app).await?;
    let mut viewers = Vec::new();
    let received = Arc::new(AtomicU64::new(0));
    for number in 0..args.viewers {
        viewers
            .push(watch(address, number, received.clone()).map_err(|cause| {
                Failure::new(FailureKind::Internal, "a viewer cannot connect").because(&cause)
            })?);
    }
    let mut sweeps = Vec::new();
    for _ in 0..args.sweeps {
        sweeps.push(sweep::sweep(app, args, &received).await?);
    }
    for (stream, viewer) in viewers {
        // It may have exited already.
        let _ = stream.shutdown(std::net::Shutdown::Both);
        let _ = viewer.join();
    }
    Ok(sweeps)
}

/// Activates the calibration document for live profiles and scans.
async fn activate(app: &App, path: &Path) -> Result<(), AppError> {
    let internal = |cause: String| AppError::new(ErrorKind::BadRequest, cause);
    let document = read_document(path).map_err(|failure| internal(failure.to_string()))?;
    let id = document.calibration.id.clone();
    let bytes = std::fs::read(path).map_err(|cause| internal(cause.to_string()))?;
    let record = CalibrationRecord {
        id: id.clone(),
        document: app.artifacts.put(&bytes).await?,
        report: None,
        capture_id: None,
        job_id: None,
        summary: json!({}),
        created_at_ms: now_ms(),
    };
    app.catalogue.commit(vec![Change::InsertCalibration(record)]).await?;
    app.calibrations.activate(&id, None, "bench", None).await?;
    Ok(())
}

async fn ready(app: &App) -> Result<(), Failure> {
    let begun = Instant::now();
    loop {
        let status = app.station.status();
        if status.camera.connected && status.position_mm.is_some() {
            return Ok(());
        }
        if let Some(fault) = status.faults.first() {
            return Err(Failure::bad_input(fault.detail.clone()).remedy(fault.remedy.clone()));
        }
        if begun.elapsed() > READY_WITHIN {
            return Err(Failure::new(FailureKind::Internal, "the recording cannot be opened in time"));
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// A viewer of profiles at 60 Hz on its own thread; received profiles are counted in `received`.
fn watch(
    address: SocketAddr,
    number: usize,
    received: Arc<AtomicU64>,
) -> std::io::Result<(std::net::TcpStream, JoinHandle<()>)> {
    let mut viewer = Viewer::open(address)?;
    viewer.send_text(r#"{"op":"subscribe","streams":[{"stream":"profile","max_rate_hz":60}]}"#)?;
    let stream = viewer.stream().try_clone()?;
    let read = move || {
        while let Ok((binary, _)) = viewer.next() {
            received.fetch_add(u64::from(binary), Ordering::Relaxed);
        }
    };
    Ok((stream, std::thread::Builder::new().name(format!("viewer-{number}")).spawn(read)?))
}

fn failure_of(problem: AppError) -> Failure {
    let cause = std::io::Error::other(problem.cause.unwrap_or_default());
    Failure::bad_input(problem.detail).because(&cause).remedy(problem.remedy.unwrap_or_default())
}

fn answer(args: &BenchServerArgs, n_images: usize, swept: &[SweepResult]) -> Answer {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "replay at {} Hz → peaks on disk, profiles to {} viewers at 60 Hz; sweeps of {} frames, {n_images} images",
        args.rate_hz, args.viewers, args.frames
    );
    swept.iter().for_each(|swept| swept.write_to(&mut text));
    if !crate::heap::allocations::COUNTED {
        text.push_str("build with --features count-allocations to count allocations\n");
    }
    let sweeps: Vec<_> = swept.iter().map(SweepResult::to_json).collect();
    let json = json!({
        "subject": "server", "rate_hz": args.rate_hz, "viewers": args.viewers, "frames": args.frames,
        "images": n_images, "sweeps": sweeps,
    });
    Answer::done(text, json)
}
