//! Stored calibration documents.

use calibration::CalibrationDocument;
use store::{Artifacts, Catalogue};

use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;

/// The document of the calibration `id`; of the active one for `None`.
///
/// # Errors
/// A problem if the calibration does not exist, none is active, or the document is damaged.
pub async fn stored_document(
    catalogue: &EventedCatalogue,
    artifacts: &dyn Artifacts,
    id: Option<&str>,
) -> Result<CalibrationDocument, AppError> {
    let id = match id {
        Some(id) => id.to_owned(),
        None => active_id(catalogue).await?,
    };
    document_of(catalogue.read(), artifacts, &id).await
}

/// The document of the calibration `id`.
///
/// # Errors
/// The calibration does not exist, or its document is damaged.
pub async fn document_of(
    read: &dyn Catalogue,
    artifacts: &dyn Artifacts,
    id: &str,
) -> Result<CalibrationDocument, AppError> {
    let record = read.calibration(id).await?;
    let what = format!("the document of calibration {id}");
    let bytes = artifacts.read(&record.document).await.map_err(|error| AppError::from(error).of_stored(&what))?;
    let text = String::from_utf8_lossy(&bytes);
    CalibrationDocument::parse(&text).map_err(|error| AppError::damaged(&what, error.to_string()))
}

async fn active_id(catalogue: &EventedCatalogue) -> Result<String, AppError> {
    catalogue.read().active().await?.and_then(|act| act.calibration_id).ok_or_else(|| {
        AppError::new(ErrorKind::Conflict, "no calibration is active")
            .remedy("calibrate and activate the result, or give a calibration_id")
    })
}
