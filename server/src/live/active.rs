//! Live profiles are computed with the active calibration, whoever activated it.

use std::sync::Arc;

use store::Artifacts;

use crate::ledger::Ledger;
use crate::live::LiveBus;
use crate::station::StationHandle;
use crate::stored_calibration::stored_document;

/// Follows the log of activations for ever: tells the bus which calibration is active, and the station whether one is.
pub async fn follow(ledger: Ledger, artifacts: Arc<dyn Artifacts>, bus: LiveBus, station: StationHandle) {
    let mut events = ledger.watch_events();
    let mut known: Option<String> = None;
    let mut told = false;
    loop {
        events.mark_unchanged();
        match ledger.read().active().await {
            Ok(act) => {
                let active = act.and_then(|act| act.calibration_id);
                if !told || active != known {
                    let usable = show(&ledger, &artifacts, &bus, active.as_deref()).await;
                    station.calibration_changed(usable);
                    (known, told) = (active, true);
                }
            }
            Err(error) => tracing::warn!("the active calibration is not known: {error}"),
        }
        if events.changed().await.is_err() {
            return;
        }
    }
}

/// Hands the calibration to the bus; whether there is one that can be used.
async fn show(ledger: &Ledger, artifacts: &Arc<dyn Artifacts>, bus: &LiveBus, id: Option<&str>) -> bool {
    let calibration = match id {
        None => None,
        Some(id) => match stored_document(ledger, &**artifacts, Some(id)).await {
            Ok(document) => Some(Arc::new(document.calibration())),
            Err(problem) => {
                tracing::error!("there are no live profiles: {}", problem.detail);
                None
            }
        },
    };
    let usable = calibration.is_some();
    bus.set_calibration(calibration);
    usable
}
