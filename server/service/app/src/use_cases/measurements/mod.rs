//! Manual measurements, the measurement plan, and studies of how well the station measures.

mod studies;

pub use studies::{NewPosition, add_position, create_study, delete_study};

use optics::Calibration;
use scanning::Cloud;
use serde_json::Value;
use store::{Change, MeasurementRecord, ScanRecord};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, MeasurementPlanChanged, event};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::measurements::plan::{KeptPlan, MeasurementPlan};
use crate::resources::measurements::{MeasureInput, changes_by, features_found, measurement};
use crate::resources::stored_scan::stored_cloud;

/// Measures on a scan and stores the result together with what `and` returns; takes some seconds.
///
/// # Errors
/// An invalid request, a feature that cannot be found (without a tolerance), or `and` fails.
pub async fn measure<E: From<AppError>>(
    app: &App,
    by: &Principal,
    scan_id: &str,
    input: MeasureInput,
    and: impl FnOnce(&MeasurementRecord) -> Result<Vec<Change>, E>,
) -> Result<MeasurementRecord, E> {
    input.request()?;
    let work = move |scan: ScanRecord, cloud: &Cloud, calibration: &Calibration| {
        measurement(&scan, cloud, calibration, &input)
    };
    let record = on_cloud(app, scan_id, (), work).await?;
    let mut all = changes_by(&record, Some(&by.actor));
    all.extend(and(&record)?);
    app.catalogue.commit(all).await.map_err(AppError::from)?;
    Ok(record)
}

/// Finds the features that a tool measures on a scan, as JSON like those of a measurement; stores nothing. `permit` is
/// dropped when the computation has ended, also if the caller no longer waits for it.
///
/// # Errors
/// An invalid request, or a feature that cannot be found.
pub async fn find_features(
    app: &App,
    scan_id: &str,
    input: MeasureInput,
    permit: impl Send + 'static,
) -> Result<Vec<Value>, AppError> {
    input.request()?;
    on_cloud(app, scan_id, permit, move |_, cloud, calibration| features_found(cloud, calibration, &input)).await
}

/// Computes on the cloud of a scan, off the async threads.
///
/// # Errors
/// The scan does not exist or has no cloud, or `work` fails.
pub(super) async fn on_cloud<T: Send + 'static>(
    app: &App,
    scan_id: &str,
    permit: impl Send + 'static,
    work: impl FnOnce(ScanRecord, &Cloud, &Calibration) -> Result<T, AppError> + Send + 'static,
) -> Result<T, AppError> {
    let scan = app.catalogue.read().scan(scan_id).await?;
    let document = stored_document(&app.catalogue, &*app.artifacts, Some(&scan.calibration_id)).await?;
    let cloud = stored_cloud(&*app.artifacts, &scan).await?;
    let computed = tokio::task::spawn_blocking(move || {
        let _permit = permit;
        work(scan, &cloud, &document.calibration())
    });
    computed.await.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "the measurement failed with an internal error")
            .because(cause.to_string())
    })?
}

/// Changes the measurement plan if `may` accepts its version (`None`: the stored one is damaged).
///
/// # Errors
/// `may` refuses, or the plan is invalid.
pub async fn change_measurement_plan<E: From<AppError>>(
    app: &App,
    by: &Principal,
    plan: MeasurementPlan,
    may: impl FnOnce(Option<u64>) -> Result<(), E>,
) -> Result<KeptPlan, E> {
    let kept = app.measurement_plans.put(plan, may).await?;
    let entry =
        Event::MeasurementPlanChanged(MeasurementPlanChanged { version: kept.version, actor: by.actor.clone() });
    // The plan is stored already; followers of events read it again at the next event.
    if let Err(error) = app.catalogue.commit(vec![event("", entry)]).await {
        tracing::warn!(%error, "a change of the measurement plan is not in the log");
    }
    Ok(kept)
}
