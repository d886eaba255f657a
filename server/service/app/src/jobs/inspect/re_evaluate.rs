//! Re-evaluates the scan of an inspection with another version of a recipe; the inspection itself is not changed.

use store::{InspectionRecord, ResultRef};

use crate::error::{AppError, ErrorKind};
use crate::jobs::inspect::{INSPECTION, message, result_on};
use crate::jobs::{ComputeContext, Done, JobEnd, ReEvaluateInput};
use crate::resources::inspections::{
    InspectedPart, InspectionBody, changed_verdicts, inspection_changes, new_inspection,
};
use crate::resources::recipes::stored_version;

/// Measures the stored scan and stores a new inspection.
pub fn run(input: &ReEvaluateInput, ctx: &ComputeContext) -> Result<Done, JobEnd> {
    let earlier = ctx.wait(ctx.catalogue.read().inspection(&input.inspection_id))?;
    let before: InspectionBody = serde_json::from_value(earlier.body.clone())
        .map_err(|cause| AppError::damaged(&format!("inspection {}", earlier.id), cause.to_string()))?;
    let Some(scan_id) = &earlier.scan_id else { return Err(without_scan(&earlier).into()) };
    let version = ctx.wait(stored_version(&ctx.catalogue, &input.recipe_id, input.recipe_version))?;
    let scan = ctx.wait(ctx.catalogue.read().scan(scan_id))?;
    ctx.check_cancelled()?;
    let result = result_on(&version, &scan, ctx)?;
    let part =
        InspectedPart { serial: earlier.serial, order: earlier.order_number, attributes: before.attributes };
    let (record, mut body) = new_inspection(&part, &version, &scan, &result, (&ctx.id, before.simulated));
    let record = InspectionRecord { re_evaluated_from: Some(earlier.id), ..record };
    body.changed = changed_verdicts(&before.result, &body.result);
    let message = format!("{}; {} verdicts changed", message(&version, &result), body.changed.len());
    Ok(Done {
        result: ResultRef { kind: INSPECTION.to_owned(), id: record.id.clone() },
        message,
        changes: vec![inspection_changes(record, &body)],
        finished_work: None,
    })
}

/// Why an inspection cannot be re-evaluated.
pub(crate) fn without_scan(inspection: &InspectionRecord) -> AppError {
    AppError::new(ErrorKind::Conflict, format!("the scan of inspection {} was deleted", inspection.id))
        .remedy("inspect the part again")
}
