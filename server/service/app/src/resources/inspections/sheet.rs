//! The report of an inspection, made on request from its record and the cloud.

use std::sync::Arc;

use metrology::{Measure, PartVerdict, Plan, evaluate};
use pipeline::Failure;
use report::inspection::{
    CharacteristicRow, InspectionSheet, ModelComparison, inspection_page, inspection_pdf, measured_surfaces,
};
use scanning::Cloud;
use store::{Artifacts, Catalogue, StoreError};

use crate::error::{AppError, ErrorKind};
use crate::resources::calibrations::stored::document_of;
use crate::resources::inspections::{CharacteristicMessage, InspectionMessage};
use crate::resources::models::{models_of, surface_profiles};
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
    let cloud = cloud_of(&inspection, read, artifacts).await?.map(Arc::new);
    let recipe = &inspection.recipe;
    let version = RecipeVersion::of(read.recipe_version(&recipe.id, recipe.version).await?)?;
    let plan = &version.recipe.plan;
    let surfaces = measured_surfaces(&result, plan);
    let comparisons = match &cloud {
        Some(cloud) => comparisons(plan, cloud, &inspection.calibration_id, read, artifacts).await?,
        None => Vec::new(),
    };
    let sheet = InspectionSheet { surfaces, comparisons, ..sheet(inspection)? };
    let written = tokio::task::spawn_blocking(move || match format {
        ReportFormat::Html => inspection_page(&sheet, cloud.as_deref()).map(String::into_bytes),
        ReportFormat::Pdf => inspection_pdf(&sheet, cloud.as_deref()),
    });
    let ended = |cause: tokio::task::JoinError| {
        AppError::new(ErrorKind::Internal, "the report could not be written").because(cause.to_string())
    };
    Ok(written.await.map_err(ended)??)
}

/// The comparisons with CAD models of a plan, made again from the cloud: an inspection stores only their statistics.
async fn comparisons(
    plan: &Plan,
    cloud: &Arc<Cloud>,
    calibration_id: &str,
    read: &dyn Catalogue,
    artifacts: &dyn Artifacts,
) -> Result<Vec<ModelComparison>, AppError> {
    let plan = surface_profiles(plan, |_| true);
    if plan.characteristics.is_empty() {
        return Ok(Vec::new());
    }
    let models = models_of(artifacts, &plan).await?;
    let calibration = document_of(read, artifacts, calibration_id).await?.calibration();
    let cloud = cloud.clone();
    let evaluated = tokio::task::spawn_blocking(move || {
        let result = evaluate(&plan, &cloud, Some(&calibration), &models).map_err(Failure::from)?;
        let named = plan.characteristics.into_iter().zip(result.characteristics);
        let compared = named.filter_map(|(asked, result)| match asked.measure {
            Measure::SurfaceProfile { model, .. } => {
                let comparison = *result.comparison?;
                Some(ModelComparison { id: asked.id, model: model.name, comparison })
            }
            _ => None,
        });
        Ok::<_, AppError>(compared.collect())
    });
    evaluated.await.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "the part could not be compared").because(cause.to_string())
    })?
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
        comparisons: Vec::new(),
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
