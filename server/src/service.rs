//! The service from start to end: what must be there before the port opens, and what must be dark before it closes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use live::LiveBus;
use live::worker::Worker;
use metrics_exporter_prometheus::PrometheusBuilder;
use serde_json::json;
use station::wall_clock::now_ms;
use station::{Fault, StationHandle};
use store::Store;
use tokio::net::TcpListener;
use tokio_util::task::TaskTracker;
use vision::LineDirection;

use crate::app::App;
use crate::calibrations::Calibrations;
use crate::captures::Captures;
use crate::closing::Closing;
use crate::config::Config;
use crate::config::limits::{CONTROL_WATCH, DRAIN_TIMEOUT};
use crate::control::{ControlDesk, was_halted};
use crate::failure::{Exit, Failure};
use crate::http::idempotency::KeysInFlight;
use crate::jobs::{JobParts, Jobs};
use crate::ledger::{Ledger, event};
use crate::measurement_plan::MeasurementPlans;
use crate::sessions::Sessions;
use crate::ws::{Sources, Streams};

/// Captures as folders, below the data folder: can be deleted at any time while the service is down.
const UNPACKED_FOLDER: &str = "unpacked";

/// What has threads of its own beside the parts that everybody holds; they end when this is dropped.
pub struct Running {
    /// The parts.
    pub app: App,
    _threads: [Worker; 2],
}

/// Everything but the port, in the order that leaves no gap: records of the dead process are settled before the
/// station opens, the station is dark before jobs can want it, jobs are taken up before anybody can ask for more.
pub async fn assemble(config: Config) -> Result<Running, Failure> {
    let config = Arc::new(config);
    let store = Store::open(&config.data).await.map_err(unusable)?;
    store.recover(now_ms()).await.map_err(unusable)?;
    let store = Arc::new(store);
    let ledger = Ledger::open(store.catalogue.clone()).await.map_err(unusable)?;
    let artifacts = store.artifacts.clone();
    let captures =
        Captures::new(ledger.clone(), artifacts.clone(), &config.data.join(UNPACKED_FOLDER)).map_err(|cause| {
            Failure::bad_input("the folder of unpacked captures cannot be made")
                .because(&cause)
                .remedy("check the data folder's rights")
        })?;
    let live = LiveBus::default();
    let station = StationHandle::start(&config.station, was_halted(&ledger).await);
    crate::camera_memory::restore(&ledger, &station).await;
    tokio::spawn(crate::camera_memory::follow(ledger.clone(), station.clone()));
    let calibrations = Calibrations::new(ledger.clone(), artifacts.clone(), live.clone(), station.clone());
    if let Err(problem) = calibrations.load_active().await {
        // Scans are refused with the same words; captures, downloads and a new calibration work.
        tracing::error!(detail = problem.detail, cause = problem.cause, "the active calibration cannot be used");
    }
    let sessions = Sessions::new(config.clone(), ledger.clone(), artifacts.clone(), station.clone());
    let free = store.clone();
    let control = ControlDesk::default();
    let jobs = Jobs::start(JobParts {
        config: config.clone(),
        ledger: ledger.clone(),
        artifacts: artifacts.clone(),
        captures: captures.clone(),
        station: station.clone(),
        control: control.clone(),
        live: live.clone(),
        free_bytes: Arc::new(move || free.free_bytes().unwrap_or(0)),
    })
    .await
    .map_err(unusable)?;
    let no_thread = |cause: std::io::Error| {
        Failure::new(Exit::Internal, "a thread of the live view cannot be started").because(&cause)
    };
    let direction = line_direction(&config);
    let view = live::view::start(&station, live.clone(), direction).map_err(no_thread)?;
    let sources = Sources {
        live: live.clone(),
        frames: station.watch_frames(),
        status: station.watch_status(),
        control: control.watch(),
        jobs: jobs.watch_progress(),
        events: ledger.watch_events(),
    };
    let (streams, encoder) = Streams::start(sources, direction).map_err(no_thread)?;
    let measurement_plans = MeasurementPlans::open(&config);
    let app = App {
        config,
        store,
        ledger,
        artifacts,
        captures,
        calibrations,
        sessions,
        station,
        jobs,
        live,
        measurement_plans,
        streams,
        control,
        halt_turn: Arc::default(),
        tasks: TaskTracker::new(),
        keys: KeysInFlight::default(),
        figures: figures()?,
        closing: Closing::default(),
    };
    Ok(Running { app, _threads: [view, encoder] })
}

/// How the lines run in the pictures.
pub fn line_direction(config: &Config) -> LineDirection {
    if config.projector.line_direction == "columns" { LineDirection::Columns } else { LineDirection::Rows }
}

/// A data directory that cannot be used: the message says what to do, with the folders that no client may see.
fn unusable(error: store::StoreError) -> Failure {
    let text = error.to_string();
    let (what, remedy) = text.split_once("; ").unwrap_or((&text, "check the data folder"));
    let failure = Failure::bad_input(what).remedy(remedy);
    match std::error::Error::source(&error) {
        Some(cause) => failure.because(cause),
        None => failure,
    }
}

fn figures() -> Result<metrics_exporter_prometheus::PrometheusHandle, Failure> {
    /// Seconds: from what nobody notices to what everybody does.
    const BUCKETS: [f64; 9] = [0.001, 0.005, 0.02, 0.05, 0.1, 0.5, 1.0, 5.0, 30.0];
    let builder = PrometheusBuilder::new().set_buckets(&BUCKETS);
    builder
        .and_then(PrometheusBuilder::install_recorder)
        .map_err(|cause| Failure::new(Exit::Internal, "the figures cannot be collected").because(&cause))
}

/// Serves until `ended`, then ends in the order that leaves nothing shining: the station first.
pub async fn run(running: Running, listener: TcpListener, ended: impl Future<Output = ()>) {
    let app = &running.app;
    let router = crate::http::router(app.clone());
    let edge = tokio::spawn(crate::edge::serve(listener, router, app.closing.clone(), app.tasks.clone()));
    let housekeeping = tokio::spawn(crate::housekeeping::keep_house(app.clone()));
    let watching = [tokio::spawn(watch_control(app.clone())), tokio::spawn(watch_store(app.clone()))];
    ended.await;
    tracing::info!("shutting down: the laser is turned off first");
    // Nothing may begin between the stop and the end.
    app.jobs.close();
    if let Err(refusal) = app.station.stop("shutdown").await {
        tracing::warn!(%refusal, "the station did not take the last stop");
    }
    app.streams.close();
    app.closing.close();
    app.jobs.shut_down().await;
    let station = app.station.clone();
    if tokio::task::spawn_blocking(move || station.shut_down()).await.is_err() {
        tracing::error!("the station thread did not end well");
    }
    housekeeping.abort();
    watching.iter().for_each(tokio::task::JoinHandle::abort);
    app.tasks.close();
    if tokio::time::timeout(DRAIN_TIMEOUT, app.tasks.wait()).await.is_err() {
        tracing::warn!("a request did not run to its end");
    }
    if edge.await.is_err() {
        tracing::error!("the edge did not end well");
    }
    tracing::info!("ended");
}

/// Says when control lapses, and lets jobs begin that waited for it.
async fn watch_control(app: App) {
    let mut changes = app.control.watch();
    loop {
        // A lease ends by time alone, which nobody tells.
        let _ = tokio::time::timeout(CONTROL_WATCH, changes.changed()).await;
        if let Some(lease) = app.control.collect_expired(Instant::now()) {
            let lapsed =
                event("control.expired", &lease.holder, json!({ "actor": lease.holder, "source": "server" }));
            if let Err(error) = app.ledger.commit(vec![lapsed]).await {
                tracing::warn!(%error, "the end of control is not stored");
            }
        }
        app.jobs.look_again();
    }
}

/// A store that cannot write ends light and motion: nothing may be made that cannot be kept.
async fn watch_store(app: App) {
    let mut failure = app.store.watch_failure();
    let Ok(failed) = failure.wait_for(Option::is_some).await.map(|reason| reason.clone()) else { return };
    let reason = failed.unwrap_or_default();
    let detail = format!("the data directory is read-only since a write failed: {reason}");
    app.station.alarm(Fault {
        device: "store",
        kind: "read_only",
        detail,
        remedy: "check the disk, then restart the server".to_owned(),
        since_ms: now_ms(),
    });
    drop(app.jobs.clear_station_jobs());
}

/// Longest time from the signal to the end of the process, whatever hangs: then it ends hard, and the drivers' leases
/// darken the laser.
pub const SHUTDOWN_LIMIT: Duration = Duration::from_secs(10);
