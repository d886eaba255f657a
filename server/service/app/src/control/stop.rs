//! Stop and reset in the service: devices, queue and record, in this order.

use crate::events::{Event, event};
use std::time::Duration;

use serde_json::json;
use station::wall_clock::now_ms;
use station::{Manual, StationRefusal};
use store::{Change, SettingRecord, StoreError};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::jobs::Waiting;

/// The setting that persists across restarts.
const HALTED: &str = "station.halted";

/// Maximum time that the response to Stop waits for its record: a hanging disk must not look like a lost Stop.
const RECORD_WAIT: Duration = Duration::from_secs(1);

/// Result of a Stop.
#[derive(Debug)]
pub struct StopOutcome {
    /// Whether the devices received it.
    pub acknowledged: Result<(), StationRefusal>,
    /// Whether it is stored, so that it persists across a restart.
    pub recorded: bool,
}

/// Stops the station. When this returns the stop is latched and the station's queue is empty, so that a client that
/// disconnects changes nothing; the rest completes whether or not the outcome is awaited.
pub fn stop(app: &App, by: &Principal) -> impl Future<Output = StopOutcome> + Send + use<> {
    let acknowledged = app.station.request_stop(&by.actor);
    let cleared = app.jobs.clear_station_jobs();
    let (app, by) = (app.clone(), by.clone());
    let (to_caller, outcome) = tokio::sync::oneshot::channel();
    app.tasks.clone().spawn(async move {
        let acknowledged = acknowledged.done().await;
        let record = app.tasks.spawn(record_stop(app.clone(), cleared, by));
        let recorded = match tokio::time::timeout(RECORD_WAIT, record).await {
            Ok(Ok(Ok(()))) => true,
            Ok(Ok(Err(error))) => {
                tracing::error!(%error, "Stop cannot be stored: it will not persist across a restart");
                false
            }
            Ok(Err(_)) | Err(_) => {
                tracing::error!("Stop is not stored yet");
                false
            }
        };
        // A caller that has gone needs no answer.
        let _ = to_caller.send(StopOutcome { acknowledged, recorded });
    });
    async move {
        outcome.await.unwrap_or(StopOutcome { acknowledged: Err(StationRefusal::ShuttingDown), recorded: false })
    }
}

/// Stores in one transaction that the station is stopped and that its waiting jobs have ended.
async fn record_stop(app: App, cleared: Vec<Waiting>, by: Principal) -> Result<(), StoreError> {
    let _turn = app.halt_turn.lock().await;
    let also = vec![
        // A faster reset has already ended the Stop.
        Change::PutSetting(halted(app.station.is_halted())),
        event("station", Event::StationStopped(by.initiator())),
    ];
    app.jobs.end_cleared_jobs(cleared, &by.actor, also).await
}

/// Resets the station and clears the stored Stop.
///
/// # Errors
/// A problem if the data directory cannot be written or a device cannot be reached.
pub async fn reset(app: &App, by: &Principal) -> Result<(), AppError> {
    if let Some(reason) = app.store.watch_failure().borrow().clone() {
        return Err(AppError::new(ErrorKind::Unavailable, format!("the data directory is read-only: {reason}"))
            .remedy("check the disk, then restart the server"));
    }
    app.station.manual(Manual::Reset).await?;
    let _turn = app.halt_turn.lock().await;
    let mut changes = vec![event("station", Event::StationReset(by.initiator()))];
    // A Stop received in the meantime has its own record.
    if !app.station.is_halted() {
        changes.push(Change::PutSetting(halted(false)));
    }
    app.catalogue.commit(changes).await?;
    Ok(())
}

/// Whether the station was stopped before this process started and not reset since. An unreadable setting counts as
/// stopped.
pub async fn was_halted(catalogue: &EventedCatalogue) -> bool {
    match catalogue.read().setting(HALTED).await {
        Ok(setting) => setting.is_some_and(|setting| setting.value != json!(false)),
        Err(error) => {
            tracing::error!(%error, "the stored Stop state cannot be read; the station counts as stopped");
            true
        }
    }
}

fn halted(value: bool) -> SettingRecord {
    SettingRecord { name: HALTED.to_owned(), value: json!(value), changed_at_ms: now_ms() }
}
