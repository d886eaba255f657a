//! The report of an inspection, made on request from its record and the cloud.

use metrology::PartVerdict;
use report::inspection::{CharacteristicRow, InspectionSheet, inspection_page, inspection_pdf, measured_surfaces};
use scanning::Cloud;
use store::{Artifacts, Catalogue, StoreError};

use crate::error::{AppError, ErrorKind};
use crate::resources::inspections::{CharacteristicMessage, InspectionMessage};
use crate::resources::recipes::RecipeVersion;
use crate::resources::stored_scan::stored_cloud;

/// Form of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportFormat {
    /// A page without scripts.
    Html,
    /// An A4 document.
    Pdf,
}

/// The bytes of the report of an inspection; without the cloud if its scan was deleted.
///
/// # Errors
/// The inspection does not exist, or a record or file is damaged.
pub async fn inspection_report(
    read: &dyn Catalogue,
    artifacts: &dyn Artifacts,
    id: &str,
    format: ReportFormat,
) -> Result<Vec<u8>, AppError> {
    let record = read.inspection(id).await?;
    let result = record.body["result"].clone();
    let inspection: InspectionMessage = record.try_into()?;
    let cloud = cloud_of(&inspection, read, artifacts).await?;
    let recipe = &inspection.recipe;
    let version = RecipeVersion::of(read.recipe_version(&recipe.id, recipe.version).await?)?;
    let surfaces = measured_surfaces(&result, &version.recipe.plan);
    let sheet = InspectionSheet { surfaces, ..sheet(inspection)? };
    let written = tokio::task::spawn_blocking(move || match format {
        ReportFormat::Html => inspection_page(&sheet, cloud.as_ref()).map(String::into_bytes),
        ReportFormat::Pdf => inspection_pdf(&sheet, cloud.as_ref()),
    });
    let ended = |cause: tokio::task::JoinError| {
        AppError::new(ErrorKind::Internal, "the report could not be written").because(cause.to_string())
    };
    Ok(written.await.map_err(ended)??)
}

async fn cloud_of(
    inspection: &InspectionMessage,
    read: &dyn Catalogue,
    artifacts: &dyn Artifacts,
) -> Result<Option<Cloud>, AppError> {
    let Some(scan_id) = &inspection.scan_id else { return Ok(None) };
    let scan = read.scan(scan_id).await?;
    match scan.cloud {
        None => Ok(None),
        Some(_) => stored_cloud(artifacts, &scan).await.map(Some),
    }
}

fn sheet(inspection: InspectionMessage) -> Result<InspectionSheet, AppError> {
    let damaged = || StoreError::DamagedRecord { kind: "inspection", id: inspection.id.clone() };
    let verdict = PartVerdict::from_name(&inspection.verdict).ok_or_else(damaged)?;
    let recipe = &inspection.recipe;
    let number = recipe.number.map_or_else(String::new, |number| format!(", number {number}"));
    let mut facts = vec![
        ("inspected at", inspection.inspected_at.clone()),
        ("order", inspection.order.clone().unwrap_or_else(|| "–".to_owned())),
        ("recipe", format!("{}@{}{number}", recipe.id, recipe.version)),
        ("recipe digest", recipe.digest.clone()),
        ("calibration", inspection.calibration_id.clone()),
    ];
    facts.extend(inspection.scan_id.clone().map(|scan| ("scan", scan)));
    facts.extend(inspection.re_evaluated_from.clone().map(|earlier| ("re-evaluates", earlier)));
    facts.extend(inspection.attributes.iter().map(|(name, value)| ("attribute", format!("{name}: {value}"))));
    Ok(InspectionSheet {
        verdict,
        simulated: inspection.simulated,
        facts,
        characteristics: inspection.results.into_iter().map(row).collect(),
        surfaces: Vec::new(),
        seq: inspection.seq,
        serial: inspection.serial,
        id: inspection.id,
    })
}

fn row(result: CharacteristicMessage) -> CharacteristicRow {
    let (lower, upper) = result.limits();
    CharacteristicRow {
        id: result.id,
        measure: result.measure,
        unit: result.unit,
        nominal: result.nominal,
        limits: [lower, upper],
        value: result.value,
        expanded_uncertainty: result.expanded_uncertainty,
        verdict: result.verdict.as_deref().and_then(PartVerdict::from_name),
        reason: result.reason,
    }
}
