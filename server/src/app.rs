//! The running service: its parts, made once and handed to whoever needs them.

use std::sync::Arc;

use live::LiveBus;
use metrics_exporter_prometheus::PrometheusHandle;
use station::StationHandle;
use store::{Artifacts, Store};
use tokio_util::task::TaskTracker;

use crate::calibrations::Calibrations;
use crate::captures::Captures;
use crate::closing::Closing;
use crate::config::Config;
use crate::control::ControlDesk;
use crate::http::idempotency::KeysInFlight;
use crate::jobs::Jobs;
use crate::ledger::Ledger;
use crate::measurement_plan::MeasurementPlans;
use crate::sessions::Sessions;
use crate::ws::Streams;

/// The parts of the running service.
#[derive(Clone)]
pub struct App {
    /// How it is set up.
    pub config: Arc<Config>,
    /// The data directory.
    pub store: Arc<Store>,
    /// The catalogue and its events.
    pub ledger: Ledger,
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
    /// What Start scans and measures.
    pub measurement_plans: MeasurementPlans,
    /// The live stream.
    pub streams: Streams,
    /// Who commands.
    pub control: ControlDesk,
    /// Held while it is stored whether the station is stopped, so that the last word on the disk is the last word.
    pub halt_turn: Arc<tokio::sync::Mutex<()>>,
    /// What was asked for and runs to its end, whether or not the client waits.
    pub tasks: TaskTracker,
    /// Requests with a key that are being answered.
    pub keys: KeysInFlight,
    /// Figures for `/metrics`.
    pub figures: PrometheusHandle,
    /// Whether the service ends.
    pub closing: Closing,
}
