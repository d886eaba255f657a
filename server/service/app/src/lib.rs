//! Every use case of the service: jobs, sessions, calibrations, scans, measurements, control and Stop.
//!
//! A use case takes typed input and returns a typed result or an [`error::AppError`] with cause and remedy. Here is
//! decided what may happen, in which order, and what is stored with it. There is no HTTP here, no status code, no exit
//! code and no SQL: doors call these functions, the store keeps what they say.

mod access;
pub mod camera;
pub mod config;
pub mod control;
pub mod error;
pub mod evented_catalogue;
pub mod events;
pub mod jobs;
mod lifetime;
pub mod progress;
pub mod recordings;
mod resources;
pub mod sessions;
pub mod use_cases;

pub use access::{idempotency, lease, principal};
pub use config::limits;
pub use lifetime::housekeeping;
pub use resources::{calibrations, captures, labels, measurements, points_page, scan_run, stored_scan, watches};

use std::sync::Arc;

use live::LiveBus;
use sha2::{Digest as _, Sha256};
use station::StationHandle;
use store::{Artifacts, Store};
use tokio_util::task::TaskTracker;

use crate::access::idempotency::KeysInFlight;
use crate::access::lease::ControlDesk;
use crate::config::AppConfig;
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::Jobs;
use crate::recordings::Recordings;
use crate::resources::calibrations::Calibrations;
use crate::resources::captures::Captures;
use crate::resources::measurements::plan::MeasurementPlans;
use crate::sessions::Sessions;
use tokio_util::sync::CancellationToken;

/// The parts of the running service, made once and handed to whoever needs them.
#[derive(Clone)]
pub struct App {
    /// How it is set up.
    pub config: Arc<AppConfig>,
    /// The data directory.
    pub store: Arc<Store>,
    /// The catalogue and its events.
    pub ledger: EventedCatalogue,
    /// What records name.
    pub artifacts: Arc<dyn Artifacts>,
    /// Captures as folders.
    pub captures: Captures,
    /// Which calibration is active, and how two differ.
    pub calibrations: Calibrations,
    /// Calibrations in the making.
    pub sessions: Sessions,
    /// The hardware.
    pub station: StationHandle,
    /// The queue.
    pub jobs: Jobs,
    /// What is seen at this moment.
    pub live: LiveBus,
    /// What is recorded of it.
    pub recordings: Recordings,
    /// What Start scans and measures.
    pub measurement_plans: MeasurementPlans,
    /// Who commands.
    pub control: ControlDesk,
    /// Held while it is stored whether the station is stopped, so that the last word on the disk is the last word.
    pub halt_turn: Arc<tokio::sync::Mutex<()>>,
    /// What was asked for and runs to its end, whether or not the client waits.
    pub tasks: TaskTracker,
    /// Requests with a key that are being answered.
    pub keys: KeysInFlight,
    /// Whether the service ends.
    pub closing: CancellationToken,
}

/// SHA-256, hexadecimal.
pub fn hash_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
