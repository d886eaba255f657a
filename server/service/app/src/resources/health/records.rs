//! Stored records that the health follows from, and how its changes are followed.

use std::sync::Arc;

use station::StationStatus;
use store::StoreError;
use tokio::sync::watch;

use crate::evented_catalogue::EventedCatalogue;
use crate::resources::health::{Health, HealthState, StationHealth};
use crate::resources::watches::WatchHistory;

/// Kinds of events after which the records may be different.
const CHANGING: [&str; 3] = ["scan.created", "calibration.activated", "calibration.rolled_back"];

/// Number of events read at a time.
const AT_A_TIME: u32 = 100;

/// Stored records that the health follows from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HealthRecords {
    /// The watches of the newest scan with the active calibration.
    pub watches: Vec<WatchOutcome>,
    /// The active calibration.
    pub calibration: Option<CalibrationInUse>,
}

/// The active calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CalibrationInUse {
    /// Its id.
    pub id: String,
    /// When it was computed, ms since 1970.
    pub created_at_ms: i64,
}

/// The result of a watch on a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WatchOutcome {
    /// `lost_steps`, `wavelength`, `order_powers`, `stage_scale`.
    pub watch: String,
    /// `quiet`, `blind`, `warning`, `invalid`.
    pub state: String,
    /// Why.
    pub reason: String,
    /// Time of the scan, ms since 1970.
    pub at_ms: i64,
}

impl WatchOutcome {
    /// The device that it watches.
    pub(super) fn device(&self) -> Option<&'static str> {
        match self.watch.as_str() {
            "lost_steps" | "stage_scale" => Some("stage"),
            "wavelength" | "order_powers" => Some("laser"),
            _ => None,
        }
    }

    /// What follows from it; `None` if nothing does.
    pub(super) fn health(&self) -> Option<Health> {
        let state = match self.state.as_str() {
            "warning" => HealthState::MaintenanceRequired,
            "invalid" => HealthState::OffSpec,
            _ => return None,
        };
        Some(Health { state, message: self.reason.clone(), since_ms: Some(self.at_ms) })
    }
}

impl HealthRecords {
    /// The records as they are stored now.
    ///
    /// # Errors
    /// The catalogue cannot be used.
    pub async fn read(catalogue: &EventedCatalogue) -> Result<Self, StoreError> {
        let active = catalogue.read().active().await?.and_then(|act| act.calibration_id);
        let Some(id) = active else { return Ok(Self::default()) };
        let history = WatchHistory::read(catalogue).await?;
        // What was seen with another calibration may be due to it.
        let newest = history.readings.last().filter(|reading| reading.calibration_id == id);
        let verdicts = newest.into_iter().flat_map(|reading| {
            let of = reading.verdicts.as_array().into_iter().flatten();
            of.map(|verdict| {
                let text = |key: &str| verdict[key].as_str().unwrap_or_default().to_owned();
                let (watch, state, reason) = (text("watch"), text("state"), text("reason"));
                WatchOutcome { watch, state, reason, at_ms: reading.at_ms }
            })
        });
        let watches = verdicts.collect();
        let created_at_ms = catalogue.read().calibration(&id).await?.created_at_ms;
        Ok(Self { watches, calibration: Some(CalibrationInUse { id, created_at_ms }) })
    }
}

/// Calls `publish` with the status of the station and its health, now and after every change of one of them. Returns
/// when the station is shut down.
pub async fn follow(
    catalogue: &EventedCatalogue,
    mut status: watch::Receiver<Arc<StationStatus>>,
    mut publish: impl FnMut(&StationStatus, &StationHealth),
) {
    let mut events = catalogue.watch_events();
    let mut seen = *events.borrow_and_update();
    let mut records = read_logged(catalogue).await;
    loop {
        let now = status.borrow_and_update().clone();
        publish(&now, &StationHealth::of(&now, records.as_ref().unwrap_or(&HealthRecords::default())));
        tokio::select! {
            changed = status.changed() => if changed.is_err() { return },
            Ok(()) = events.changed() => {
                let newest = *events.borrow_and_update();
                if records.is_none() || changes_records(catalogue, seen).await {
                    records = read_logged(catalogue).await.or(records);
                }
                seen = newest;
            }
        }
    }
}

async fn read_logged(catalogue: &EventedCatalogue) -> Option<HealthRecords> {
    let read = HealthRecords::read(catalogue).await;
    read.inspect_err(|error| tracing::warn!(%error, "watches and calibration cannot be read")).ok()
}

/// Whether an event after `seen` may have changed the records; also if that cannot be found out.
async fn changes_records(catalogue: &EventedCatalogue, seen: i64) -> bool {
    match catalogue.read().events_after(seen, AT_A_TIME).await {
        Ok(listed) => {
            let is_all = listed.damaged.is_empty() && listed.records.len() < AT_A_TIME as usize;
            !is_all || listed.records.iter().any(|event| CHANGING.contains(&event.kind.as_str()))
        }
        Err(_) => true,
    }
}
