//! Re-evaluates an inspection with another version of a recipe or another calibration; the inspection itself is not changed.

use store::{InspectionRecord, ResultRef, ScanRecord};

use crate::error::{AppError, ErrorKind};
use crate::jobs::inspect::{INSPECTION, message, result_on};
use crate::jobs::scan::recompute::recomputed;
use crate::jobs::{ComputeContext, Done, JobEnd, ReEvaluateInput};
use crate::resources::inspections::{
    InspectedPart, InspectionBody, changed_verdicts, inspection_changes, new_inspection,
};
use crate::resources::recipes::{RecipeVersion, stored_version};
use crate::resources::stored_scan::stored_cloud;

/// Measures the stored scan and stores a new inspection. With another calibration than that of the scan, the points are
/// triangulated again from the stored centrelines, which gives a new scan.
pub fn run(input: &ReEvaluateInput, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    let earlier = ctx.wait(ctx.catalogue.read().inspection(&input.inspection_id))?;
    let before: InspectionBody = serde_json::from_value(earlier.body.clone())
        .map_err(|cause| AppError::damaged(&format!("inspection {}", earlier.id), cause.to_string()))?;
    let Some(scan_id) = &earlier.scan_id else { return Err(without_scan(&earlier).into()) };
    let version = ctx.wait(stored_version(&ctx.catalogue, &input.recipe_id, input.recipe_version))?;
    let scan = ctx.wait(ctx.catalogue.read().scan(scan_id))?;
    ctx.check_cancelled()?;
    let anew = ReEvaluation { earlier: &earlier, before: &before, version: &version };
    match input.calibration_id.as_deref().filter(|id| *id != scan.calibration_id) {
        None => anew.done(&scan, ctx),
        other => recomputed(&scan, other, ctx, |measured| {
            let done = anew.done(&measured.made.record, ctx)?;
            let changes = measured.changes().into_iter().chain(done.changes).collect();
            Ok(Done { changes, ..done })
        }),
    }
}

/// An inspection that is evaluated again.
struct ReEvaluation<'a> {
    earlier: &'a InspectionRecord,
    before: &'a InspectionBody,
    version: &'a RecipeVersion,
}

impl ReEvaluation<'_> {
    /// Measures the scan; the new inspection refers to the earlier one.
    fn done(&self, scan: &ScanRecord, ctx: &ComputeContext) -> Result<Done, JobEnd> {
        let Self { earlier, before, version } = self;
        let cloud = ctx.wait(stored_cloud(&*ctx.artifacts, scan))?;
        let result = result_on(version, scan, &cloud, ctx)?;
        let part = InspectedPart {
            serial: earlier.serial.clone(),
            order: earlier.order_number.clone(),
            attributes: before.attributes.clone(),
        };
        let (record, mut body) = new_inspection(&part, version, scan, &result, (&ctx.id, before.simulated));
        let record = InspectionRecord { re_evaluated_from: Some(earlier.id.clone()), ..record };
        body.changed = changed_verdicts(&before.result, &body.result);
        Ok(Done {
            result: ResultRef { kind: INSPECTION.to_owned(), id: record.id.clone() },
            message: format!("{}; {} verdicts changed", message(version, &result), body.changed.len()),
            changes: inspection_changes(record, &body),
            finished_work: None,
        })
    }
}

/// Why an inspection cannot be re-evaluated.
pub(crate) fn without_scan(inspection: &InspectionRecord) -> AppError {
    AppError::new(ErrorKind::Conflict, format!("the scan of inspection {} was deleted", inspection.id))
        .remedy("inspect the part again")
}
