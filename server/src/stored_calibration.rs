//! Calibration documents as the store keeps them.

use calibration::CalibrationDocument;
use store::Artifacts;

use crate::ledger::Ledger;
use crate::problem::{Problem, ProblemKind};

/// The document of the calibration `id`; of the active one for `None`.
///
/// # Errors
/// A problem: no such calibration, none active, or a damaged document.
pub async fn stored_document(
    ledger: &Ledger,
    artifacts: &dyn Artifacts,
    id: Option<&str>,
) -> Result<CalibrationDocument, Problem> {
    let id = match id {
        Some(id) => id.to_owned(),
        None => active_id(ledger).await?,
    };
    let record = ledger.read().calibration(&id).await?;
    let what = format!("the document of calibration {id}");
    let bytes = artifacts.read(&record.document).await.map_err(|error| Problem::from(error).of_stored(&what))?;
    let text = String::from_utf8_lossy(&bytes);
    CalibrationDocument::parse(&text).map_err(|error| Problem::damaged(&what, error.to_string()))
}

async fn active_id(ledger: &Ledger) -> Result<String, Problem> {
    ledger.read().active().await?.and_then(|act| act.calibration_id).ok_or_else(|| {
        Problem::new(ProblemKind::Conflict, "no calibration is active")
            .remedy("calibrate and activate the result, or name a calibration_id")
    })
}
