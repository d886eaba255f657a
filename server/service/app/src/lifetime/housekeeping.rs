//! Background housekeeping: old records are pruned, and unreferenced files are deleted, shortly after a record was
//! deleted and once an hour.

use std::collections::HashSet;

use station::wall_clock::now_ms;
use store::{ArtifactId, Change, StoreError};

use crate::App;
use crate::config::limits::{
    EVENTS_KEPT, HOUSEKEEPING_PERIOD, IDEMPOTENCY_KEPT_MS, JOBS_KEPT, JOBS_KEPT_MS, SWEEP_PAUSE,
};
use crate::doors::EVENTS_KEPT_FOR_DOORS;
use crate::jobs::{export, scan};

/// Runs until it is aborted. The first round, at start-up, deletes leftovers of a crashed process.
pub async fn run_housekeeping(app: App) {
    let mut period = tokio::time::interval(HOUSEKEEPING_PERIOD);
    loop {
        tokio::select! {
            _ = period.tick() => {
                if let Err(error) = prune_old(&app).await {
                    tracing::warn!(%error, "old records were not pruned");
                }
                if let Err(error) = app.store.back_up().await {
                    tracing::warn!(%error, "the catalogue was not copied");
                }
            }
            () = app.catalogue.artifacts_left() => {}
        }
        match sweep(&app).await {
            Ok(0) => {}
            Ok(freed_bytes) => tracing::info!(freed_bytes, "unreferenced files were deleted"),
            Err(error) => tracing::warn!(%error, "unreferenced files were not deleted"),
        }
        tokio::time::sleep(SWEEP_PAUSE).await;
    }
}

async fn prune_old(app: &App) -> Result<(), StoreError> {
    let (last, now) = (app.catalogue.read().last_event_seq().await?, now_ms());
    let mut changes = vec![
        Change::PruneIdempotencyKeys { at_ms: now - IDEMPOTENCY_KEPT_MS },
        Change::PruneEndedJobs { before_ms: now - JOBS_KEPT_MS, keep_newest: JOBS_KEPT },
    ];
    // A door that is behind still needs the events after its position.
    let passed = app.doors.passed_by_all().unwrap_or(last).max(last - EVENTS_KEPT_FOR_DOORS);
    let prunable = passed.min(last - EVENTS_KEPT);
    if prunable > 0 {
        changes.push(Change::PruneEventsThrough { seq: prunable });
    }
    app.catalogue.commit(changes).await?;
    Ok(())
}

/// Deletes artifacts, exports, unpacked captures and images of stopped scans without records.
async fn sweep(app: &App) -> Result<u64, StoreError> {
    scan::remove_orphans(&app.catalogue, &*app.artifacts).await;
    let also_named = |named: &HashSet<ArtifactId>| {
        tokio::task::block_in_place(|| {
            app.captures.evict_others(named);
            export::remembered_of(&*app.artifacts, named)
        })
    };
    app.store.sweep_unreferenced(also_named).await
}
