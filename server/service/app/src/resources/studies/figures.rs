//! Figures of an artefact on a stored scan.

use metrology::acceptance::{self, AcceptancePlan, Figures, Plate, ProbeRequest};
use pipeline::Failure;
use store::{Artifacts, ScanRecord};

use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::calibrations::stored::stored_document;
use crate::resources::stored_scan::stored_cloud;

/// The figures of a procedure on the cloud of a scan; takes seconds.
///
/// # Errors
/// The artefact cannot be found, or the cloud or its calibration cannot be read.
pub async fn position_figures(
    catalogue: &EventedCatalogue,
    artifacts: &dyn Artifacts,
    scan: &ScanRecord,
    plan: &AcceptancePlan,
    request: ProbeRequest,
) -> Result<Figures, AppError> {
    let calibration = stored_document(catalogue, artifacts, Some(&scan.calibration_id)).await?.calibration();
    let cloud = stored_cloud(artifacts, scan).await?;
    let plan = plan.clone();
    let work = move || acceptance::probe(&cloud, &calibration, &plan, &request);
    let found = tokio::task::spawn_blocking(work).await.map_err(|cause| ended(&cause))?;
    Ok(found.map_err(Failure::from)?)
}

/// RMS of the differences of single points of a plate between two scans, mm.
///
/// # Errors
/// The scans have too few points in common, or a cloud cannot be read.
pub async fn repeat_difference_mm(
    artifacts: &dyn Artifacts,
    [first, other]: [&ScanRecord; 2],
    plate: Plate,
) -> Result<f64, AppError> {
    let (first, other) = (stored_cloud(artifacts, first).await?, stored_cloud(artifacts, other).await?);
    let work = move || acceptance::repeat_difference_mm(&first, &other, &plate);
    let found = tokio::task::spawn_blocking(work).await.map_err(|cause| ended(&cause))?;
    found.map_err(|error| {
        AppError::new(ErrorKind::Impossible, format!("the scans cannot be compared point by point: {error}"))
            .at("/scan_id")
            .remedy("scan the plate again with the settings of the first scan, without moving it")
    })
}

fn ended(cause: &tokio::task::JoinError) -> AppError {
    AppError::new(ErrorKind::Internal, "the evaluation failed with an internal error").because(cause.to_string())
}
