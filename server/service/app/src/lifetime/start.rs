//! Start-up and shutdown: what must be ready before a port opens, and that the laser is off before it closes.

use crate::access::principal::Principal;
use crate::events::{Event, event};
use std::sync::Arc;
use std::time::Instant;

use live::LiveBus;
use pipeline::Failure;
use remedy::Remedy as _;
use station::wall_clock::now_ms;
use station::{Fault, StationHandle};
use store::Store;
use tokio::task::JoinHandle;
use tokio_util::task::TaskTracker;

use crate::App;
use crate::access::idempotency::KeysInFlight;
use crate::access::lease::ControlDesk;
use crate::camera::dark_frame::DarkFrameStore;
use crate::config::AppConfig;
use crate::config::limits::{CONTROL_WATCH, DRAIN_TIMEOUT};
use crate::control::was_halted;
use crate::doors::{Door, Doors};
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::{JobParts, Jobs};
use crate::lifetime::housekeeping::run_housekeeping;
use crate::recordings::figures::Ended;
use crate::recordings::{RecordingParts, Recordings};
use crate::resources::calibrations::Calibrations;
use crate::resources::captures::Captures;
use crate::resources::measurements::plan::MeasurementPlans;
use crate::sessions::Sessions;
use tokio_util::sync::CancellationToken;

/// Folder of unpacked captures in the data folder; may be deleted while the service is down.
const UNPACKED_FOLDER: &str = "unpacked";

impl App {
    /// Starts all parts of the service except its interfaces, in a safe order: records of a crashed process are updated
    /// before the station opens, the laser is off before jobs can use the station, and stored jobs are queued before new
    /// ones are accepted.
    ///
    /// # Errors
    /// If the data directory cannot be used.
    pub async fn start(config: AppConfig, doors: Vec<Arc<dyn Door>>) -> Result<Self, Failure> {
        let config = Arc::new(config);
        let store = Store::open(&config.data).await.map_err(unusable)?;
        store.recover(now_ms()).await.map_err(unusable)?;
        let store = Arc::new(store);
        let catalogue = EventedCatalogue::open(store.catalogue.clone()).await.map_err(unusable)?;
        let artifacts = store.artifacts.clone();
        let captures = Captures::new(catalogue.clone(), artifacts.clone(), &config.data.join(UNPACKED_FOLDER))
            .map_err(|cause| {
                Failure::bad_input("the folder of unpacked captures cannot be created")
                    .because(&cause)
                    .remedy("check the permissions of the data folder")
            })?;
        let live = LiveBus::default();
        let station = StationHandle::start(&config.station, was_halted(&catalogue).await);
        crate::camera::memory::restore(&catalogue, &station).await;
        tokio::spawn(crate::camera::memory::follow(catalogue.clone(), station.clone()));
        let dark_frames = DarkFrameStore::open(&config.data, &station, config.projector.direction_of(0));
        let calibrations = Calibrations::new(catalogue.clone(), artifacts.clone(), live.clone(), station.clone());
        if let Err(error) = calibrations.load_active().await {
            // Scans are refused with the same message; captures, downloads and new calibrations work.
            tracing::error!(detail = error.detail, cause = error.cause, "the active calibration cannot be used");
        }
        let sessions = Sessions::new(config.clone(), catalogue.clone(), artifacts.clone(), station.clone());
        let free = store.clone();
        let free_bytes: Arc<dyn Fn() -> u64 + Send + Sync> = Arc::new(move || free.free_bytes().unwrap_or(0));
        let recordings = Recordings::new(RecordingParts {
            config: config.clone(),
            catalogue: catalogue.clone(),
            artifacts: artifacts.clone(),
            station: station.clone(),
            live: live.clone(),
            free_bytes: free_bytes.clone(),
        });
        recordings.recover().await;
        let control = ControlDesk::default();
        let jobs = Jobs::start(JobParts {
            config: config.clone(),
            catalogue: catalogue.clone(),
            artifacts: artifacts.clone(),
            captures: captures.clone(),
            station: station.clone(),
            control: control.clone(),
            live: live.clone(),
            recordings: recordings.clone(),
            free_bytes,
        })
        .await
        .map_err(unusable)?;
        let doors = Doors::new(catalogue.clone(), doors);
        let measurement_plans = MeasurementPlans::open(&config);
        Ok(Self {
            config,
            store,
            catalogue,
            artifacts,
            captures,
            calibrations,
            dark_frames,
            sessions,
            station,
            jobs,
            live,
            recordings,
            measurement_plans,
            doors,
            control,
            halt_turn: Arc::default(),
            tasks: TaskTracker::new(),
            keys: KeysInFlight::default(),
            closing: CancellationToken::new(),
        })
    }

    /// Background tasks, until they are aborted.
    pub fn watch(&self) -> Vec<JoinHandle<()>> {
        let mut tasks = self.doors.start(self);
        tasks.push(tokio::spawn(run_housekeeping(self.clone())));
        tasks.push(tokio::spawn(watch_control(self.clone())));
        tasks.push(tokio::spawn(watch_store(self.clone())));
        tasks
    }

    /// Stops laser and motion, then jobs, then the station; interfaces see [`App::closing`] in between.
    pub async fn shut_down(&self) {
        // Nothing may start between the stop and the end.
        self.jobs.close();
        if let Err(refusal) = self.station.stop("shutdown").await {
            tracing::warn!(%refusal, "the station refused the final stop");
        }
        self.closing.cancel();
        self.jobs.shut_down().await;
        self.recordings.end(None, Ended::ServiceEnded).await;
        let station = self.station.clone();
        if tokio::task::spawn_blocking(move || station.shut_down()).await.is_err() {
            tracing::error!("the station thread ended with an error");
        }
    }

    /// Waits for running requests.
    pub async fn drain(&self) {
        self.tasks.close();
        if tokio::time::timeout(DRAIN_TIMEOUT, self.tasks.wait()).await.is_err() {
            tracing::warn!("a request did not finish in time");
        }
    }
}

/// An unusable data directory; this message is for the console and contains paths that clients must not see.
fn unusable(error: store::StoreError) -> Failure {
    let remedy = error.remedy().unwrap_or("check the data folder".into());
    let failure = Failure::bad_input(error.to_string()).remedy(remedy);
    match std::error::Error::source(&error) {
        Some(cause) => failure.because(cause),
        None => failure,
    }
}

/// Publishes the expiry of control, and starts jobs that waited for it.
async fn watch_control(app: App) {
    let mut changes = app.control.watch();
    loop {
        // A lease expires without a request.
        let _ = tokio::time::timeout(CONTROL_WATCH, changes.changed()).await;
        if let Some(lease) = app.control.collect_expired(Instant::now()) {
            let lapsed = event(
                &lease.holder,
                Event::ControlExpired(Principal::local(&lease.holder, "server", None).initiator()),
            );
            if let Err(error) = app.catalogue.commit(vec![lapsed]).await {
                tracing::warn!(%error, "the end of control is not stored");
            }
        }
        app.jobs.recheck_control();
    }
}

/// A store that cannot write stops laser and motion: results could not be stored.
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
