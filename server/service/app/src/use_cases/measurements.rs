//! Measuring by hand, and what is measured on every part.

use store::{Change, MeasurementRecord};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, PlanChanged, event};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::measurements::plan::{KeptPlan, MeasurementPlan};
use crate::resources::measurements::{MeasureInput, changes_by, measurement};
use crate::resources::stored_scan::stored_cloud;

/// Measures on a scan and keeps it, together with what `and` returns; takes up to some seconds.
///
/// # Errors
/// A request that cannot be, a feature that is not there and for which no verdict was asked, or what `and` says.
pub async fn measure<E: From<AppError>>(
    app: &App,
    by: &Principal,
    scan_id: &str,
    input: MeasureInput,
    and: impl FnOnce(&MeasurementRecord) -> Result<Vec<Change>, E>,
) -> Result<MeasurementRecord, E> {
    input.request()?;
    let scan = app.ledger.read().scan(scan_id).await.map_err(AppError::from)?;
    let document = stored_document(&app.ledger, &*app.artifacts, Some(&scan.calibration_id)).await?;
    let cloud = stored_cloud(&*app.artifacts, &scan).await?;
    let work = move || measurement(&scan, &cloud, &document.calibration(), &input);
    let record = tokio::task::spawn_blocking(work).await.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "the measurement ended by a defect").because(cause.to_string())
    })??;
    let mut all = changes_by(&record, Some(&by.actor));
    all.extend(and(&record)?);
    app.ledger.commit(all).await.map_err(AppError::from)?;
    Ok(record)
}

/// Changes what Start scans and measures, if `may` agrees to its version (`None`: what is kept is damaged).
///
/// # Errors
/// What `may` says, or a plan that cannot be.
pub async fn change_measurement_plan<E: From<AppError>>(
    app: &App,
    by: &Principal,
    plan: MeasurementPlan,
    may: impl FnOnce(Option<u64>) -> Result<(), E>,
) -> Result<KeptPlan, E> {
    let kept = app.measurement_plans.put(plan, may).await?;
    let told = Event::MeasurementPlanChanged(PlanChanged { version: kept.version, actor: by.actor.clone() });
    // The plan is kept already; who follows events reads it again at the next one.
    if let Err(error) = app.ledger.commit(vec![event("", told)]).await {
        tracing::warn!(%error, "a change of the measurement plan is not in the log");
    }
    Ok(kept)
}
