//! Inspection of a part on the station or of the frames of a capture: scan, measurement according to the plan of the
//! recipe, verdict; and re-evaluation of a stored scan.

mod re_evaluate;
#[cfg(test)]
mod tests;

use std::time::Instant;

use metrology::PlanResult;
use scanning::Cloud;
use serde_json::json;
use store::{ResultRef, ScanRecord};

use crate::jobs::plan::TIMING;
use crate::jobs::progress::Phase;
use crate::jobs::scan::{Measured, at_station_measured, of_capture_measured};
use crate::jobs::{ComputeContext, Done, InspectInput, JobEnd, RecordedFrames, ScanInput, StationContext};
use crate::resources::calibrations::stored::stored_document;
use crate::resources::inspections::{inspection_changes, judged, new_inspection, newly_violated};
use crate::resources::models::models_of;
use crate::resources::recipes::{RecipeVersion, stored_version};
use crate::resources::scan_run::{ScanPurpose, ScanSettings};

pub use re_evaluate::run as re_evaluate;
pub(crate) use re_evaluate::without_scan;

/// The record kind of inspections.
const INSPECTION: &str = "inspection";

/// Inspects a part. A job cancelled between scan and verdict keeps its scan.
pub fn at_station(input: &InspectInput, ctx: &StationContext) -> Result<Done, JobEnd> {
    let version = version_of(input, ctx)?;
    let measured = at_station_measured(&scan_of(&version.recipe.scan, input), ctx)?;
    inspected(input, &version, measured, ctx.station.status().simulated.is_some(), ctx)
}

/// Inspects the part that the frames of a capture show, without the station. As it is recorded, the result counts as
/// simulated.
pub fn of_capture(input: &InspectInput, frames: &RecordedFrames, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    let version = version_of(input, ctx)?;
    let measured = of_capture_measured(&scan_of(&ScanSettings::default(), input), frames, ctx)?;
    inspected(input, &version, measured, true, ctx)
}

fn version_of(input: &InspectInput, ctx: &ComputeContext) -> Result<RecipeVersion, JobEnd> {
    Ok(ctx.wait(stored_version(&ctx.catalogue, &input.recipe_id, input.recipe_version))?)
}

/// Measures and judges the scan.
fn inspected(
    input: &InspectInput,
    version: &RecipeVersion,
    mut measured: Measured,
    simulated: bool,
    ctx: &ComputeContext,
) -> Result<Done, JobEnd> {
    if ctx.cancel.is_cancelled() {
        return Err(JobEnd::CancelledAfter(Box::new(measured.done())));
    }
    let began = Instant::now();
    let cloud = measured.made.cloud(ctx)?;
    let scan = &measured.made.record;
    let result = result_on(version, scan, &cloud, ctx)?;
    let (record, mut body) = new_inspection(&input.part, version, scan, &result, (&ctx.id, simulated));
    body.violated_rules = ctx.wait(newly_violated(ctx.catalogue.read(), &record, &body))?;
    let timing = &mut measured.made.record.report[TIMING];
    timing["measuring_s"] = json!(began.elapsed().as_secs_f64());
    timing["n_measured"] = json!(version.recipe.plan.characteristics.len());
    let message = message(version, &result);
    let id = record.id.clone();
    let mut done = measured.done_with(ResultRef { kind: INSPECTION.to_owned(), id }, Some(message));
    done.changes.extend(inspection_changes(record, &body));
    Ok(done)
}

/// Measures the plan of a recipe on the cloud of a scan.
fn result_on(
    version: &RecipeVersion,
    scan: &ScanRecord,
    cloud: &Cloud,
    ctx: &ComputeContext,
) -> Result<PlanResult, JobEnd> {
    let plan = &version.recipe.plan;
    ctx.report(1.0, Phase::Measuring.counted(0, plan.characteristics.len()), "measuring");
    let document = ctx.wait(stored_document(&ctx.catalogue, &*ctx.artifacts, Some(&scan.calibration_id)))?;
    let models = ctx.wait(models_of(&*ctx.artifacts, plan))?;
    Ok(judged(plan, scan, cloud, &document.calibration(), &models)?)
}

fn message(version: &RecipeVersion, result: &PlanResult) -> String {
    format!("{} by {}", result.verdict.label(), version.name())
}

/// The scan of a part with the settings of a recipe and the active calibration.
pub(crate) fn scan_of(settings: &ScanSettings, input: &InspectInput) -> ScanInput {
    ScanInput {
        source: input.source.clone(),
        name: Some(input.part.serial.clone()),
        settings: settings.clone(),
        calibration_id: None,
        resume_scan_id: None,
        measure: Vec::new(),
        purpose: ScanPurpose::Production,
    }
}
