//! Evaluation of a plan on the scan of a part.

use metrology::{MeasureError, Models, Plan, PlanResult, evaluate};
use optics::Calibration;
use scanning::Cloud;
use store::{ScanRecord, ScanState};

use crate::error::AppError;
use crate::resources::watches::why_invalid;
use pipeline::Failure;

/// Measures the plan on the cloud of a scan. A part that cannot be measured is invalid, as is one whose scan allows no
/// verdict.
///
/// # Errors
/// If the calibration is not that of the cloud.
pub fn judged(
    plan: &Plan,
    scan: &ScanRecord,
    cloud: &Cloud,
    calibration: &Calibration,
    models: &Models,
) -> Result<PlanResult, AppError> {
    let result = match evaluate(plan, cloud, Some(calibration), models) {
        Ok(result) => result,
        Err(error @ MeasureError::CalibrationMismatch { .. }) => return Err(Failure::from(error).into()),
        Err(error) => PlanResult::not_measured(plan, &error),
    };
    Ok(match scan.state {
        ScanState::Complete => result,
        ScanState::Partial => {
            result.invalidated(plan, "the scan was stopped early: parts of the surface are missing")
        }
        ScanState::Invalid => result.invalidated(plan, &format!("the scan is invalid: {}", why_invalid(scan))),
    })
}
