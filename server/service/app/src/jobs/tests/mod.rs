//! The queue with the real store and a simulated station with a quarter of the usual pixels.

#![allow(clippy::unwrap_used)]

mod calibrating;
mod queue;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use live::LiveBus;
use serde::Serialize;
use serde::de::DeserializeOwned;
use station::StationHandle;
use store::{JobState, Store};
use twin::{StationModel, StationShape, TwinOptions, TwinStation};

use crate::access::lease::ControlDesk;
use crate::config::AppConfig;
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::{Done, Job, JobEnd, JobInput, JobParts, JobView, Jobs, StationContext};
use crate::recordings::{RecordingParts, Recordings};
use crate::resources::captures::Captures;

/// Timeout: longer than anything here takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// A service without its network.
pub(crate) struct Bench {
    pub parts: JobParts,
    pub store: Store,
    pub free_bytes: Arc<AtomicU64>,
    _folder: tempfile::TempDir,
}

/// The usual station with a quarter of its pixels.
pub(crate) fn small() -> StationShape {
    StationShape { width_px: 640, height_px: 512, ..StationShape::default() }
}

impl Bench {
    pub async fn new(shape: &StationShape) -> Self {
        Self::with(shape, |_| {}).await
    }

    /// With a different configuration.
    pub async fn with(shape: &StationShape, configure: impl FnOnce(&mut AppConfig)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut config = AppConfig::simulated(folder.path().join("data"));
        configure(&mut config);
        let config = Arc::new(config);
        let store = Store::open(&config.data).await.unwrap();
        let catalogue = EventedCatalogue::open(store.catalogue.clone()).await.unwrap();
        let cache = folder.path().join("unpacked");
        let model = StationModel::seeded(7, shape).unwrap();
        let free_bytes = Arc::new(AtomicU64::new(u64::MAX));
        let free = free_bytes.clone();
        let station = StationHandle::over_twin(TwinStation::new(model, TwinOptions::of(shape.stage)));
        let live = LiveBus::default();
        let recordings = Recordings::new(RecordingParts {
            config: config.clone(),
            catalogue: catalogue.clone(),
            artifacts: store.artifacts.clone(),
            station: station.clone(),
            live: live.clone(),
            free_bytes: Arc::new(|| u64::MAX),
        });
        let parts = JobParts {
            config,
            captures: Captures::new(catalogue.clone(), store.artifacts.clone(), &cache).unwrap(),
            catalogue,
            artifacts: store.artifacts.clone(),
            station,
            control: ControlDesk::default(),
            live,
            recordings,
            free_bytes: Arc::new(move || free.load(Ordering::SeqCst)),
        };
        Self { parts, store, free_bytes, _folder: folder }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.parts.station.shut_down();
    }
}

/// Runs a job with its input and outcome passed through their serialised form, as for another process.
pub(crate) fn as_if_elsewhere(input: JobInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    through_text(&match Job::from(input) {
        Job::Station(job) => job.run(ctx),
        Job::Compute(job) => through_text(&job).run(&ctx.compute),
    })
}

fn through_text<T: Serialize + DeserializeOwned>(value: &T) -> T {
    serde_json::from_str(&serde_json::to_string(value).unwrap()).unwrap()
}

/// Waits until the job has ended.
pub(crate) async fn ended(jobs: &Jobs, id: &str) -> JobView {
    let begun = Instant::now();
    loop {
        let view = jobs.view(id).await.unwrap();
        if view.record.state.is_terminal() {
            return view;
        }
        assert!(begun.elapsed() < PATIENCE, "{view:?}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Waits until the job runs.
pub(crate) async fn running(jobs: &Jobs, id: &str) -> JobView {
    let begun = Instant::now();
    loop {
        let view = jobs.view(id).await.unwrap();
        if view.record.state == JobState::Running {
            return view;
        }
        assert!(!view.record.state.is_terminal() && begun.elapsed() < PATIENCE, "{view:?}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
