//! Every use case of the service: jobs, sessions, calibrations, scans, measurements, control and Stop.
//!
//! A use case takes typed input and returns a typed result or an [`error::AppError`] with cause and remedy. This crate
//! decides what is allowed, in which order it happens, and what is stored with it. It contains no HTTP, no status codes,
//! no exit codes and no SQL: interfaces call these functions, the store persists their results.

mod access;
pub mod camera;
pub mod config;
pub mod control;
pub mod doors;
pub mod error;
pub mod evented_catalogue;
pub mod events;
pub mod jobs;
mod lifetime;
pub mod recordings;
mod resources;
pub mod sessions;
pub mod use_cases;

pub use access::{idempotency, lease, principal};
pub use config::limits;
pub use lifetime::housekeeping;
pub use resources::{
    calibrations, captures, health, inspections, labels, measurements, models, points_page, recipes, scan_run,
    statistics, stored_scan, studies, watches,
};

use std::sync::Arc;

use live::LiveBus;
use sha2::{Digest as _, Sha256};
use station::StationHandle;
use store::{Artifacts, Store};
use tokio_util::task::TaskTracker;

use crate::access::idempotency::KeysInFlight;
use crate::access::lease::ControlDesk;
use crate::camera::dark_frame::DarkFrameStore;
use crate::config::AppConfig;
use crate::doors::Doors;
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::Jobs;
use crate::recordings::Recordings;
use crate::resources::calibrations::Calibrations;
use crate::resources::captures::Captures;
use crate::resources::measurements::plan::MeasurementPlans;
use crate::sessions::Sessions;
use tokio_util::sync::CancellationToken;

/// The parts of the running service, created once and shared.
#[derive(Clone)]
pub struct App {
    /// Configuration.
    pub config: Arc<AppConfig>,
    /// The data directory.
    pub store: Arc<Store>,
    /// The catalogue and its events.
    pub catalogue: EventedCatalogue,
    /// The artifact store.
    pub artifacts: Arc<dyn Artifacts>,
    /// Captures as folders.
    pub captures: Captures,
    /// The active calibration and comparisons.
    pub calibrations: Calibrations,
    /// The camera's dark frame.
    pub dark_frames: DarkFrameStore,
    /// Calibration sessions.
    pub sessions: Sessions,
    /// The hardware.
    pub station: StationHandle,
    /// The queue.
    pub jobs: Jobs,
    /// The live bus.
    pub live: LiveBus,
    /// The recorder.
    pub recordings: Recordings,
    /// The measurement plan.
    pub measurement_plans: MeasurementPlans,
    /// The doors to other systems.
    pub doors: Doors,
    /// The control lease.
    pub control: ControlDesk,
    /// Held while the Stop state is stored, so that the newest state is stored last.
    pub halt_turn: Arc<tokio::sync::Mutex<()>>,
    /// Requests that run to completion whether or not the client waits.
    pub tasks: TaskTracker,
    /// Idempotency keys in progress.
    pub keys: KeysInFlight,
    /// Set at shutdown.
    pub closing: CancellationToken,
}

/// SHA-256, hexadecimal.
pub fn hash_hex(bytes: &[u8]) -> String {
    hex::encode(Sha256::digest(bytes))
}
