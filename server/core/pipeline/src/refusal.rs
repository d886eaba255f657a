//! Conversion of the core's errors to failures: kind, place and remedy.

use std::path::Path;

use calibration::{CalibrationError, DocumentError};
use capture::{CaptureError, ImageFileError};
use metrology::{MeasureError, NominalError, PlanDocumentError};
use remedy::Remedy;
use scanning::{FileError, ScanError};

use crate::failure::{Failure, FailureKind};

impl From<CaptureError> for Failure {
    fn from(error: CaptureError) -> Self {
        let failure = failure_of(FailureKind::BadInput, &error);
        match error {
            CaptureError::ImageUnusable { entry, path, .. } => failure.in_file(&path).at_entry(entry),
            _ => failure,
        }
    }
}

impl From<ImageFileError> for Failure {
    fn from(error: ImageFileError) -> Self {
        failure_of(FailureKind::BadInput, &error)
    }
}

impl From<CalibrationError> for Failure {
    fn from(error: CalibrationError) -> Self {
        match error {
            CalibrationError::Cancelled => Self::cancelled(),
            CalibrationError::OrdersUnsorted { .. } => {
                failure_of(FailureKind::BadInput, &error).at_entry("projector.orders")
            }
            CalibrationError::RotationMismatch { .. } | CalibrationError::MixedStages { .. } => {
                failure_of(FailureKind::BadInput, &error).at_entry("stage_views")
            }
            _ => failure_of(FailureKind::Unobservable, &error),
        }
    }
}

impl From<ScanError> for Failure {
    fn from(error: ScanError) -> Self {
        let kind = match error {
            ScanError::NoStage { .. } => FailureKind::Unobservable,
            _ => FailureKind::BadInput,
        };
        failure_of(kind, &error)
    }
}

impl From<MeasureError> for Failure {
    fn from(error: MeasureError) -> Self {
        let kind = match error {
            MeasureError::CalibrationMismatch { .. } | MeasureError::ModelMissing { .. } => FailureKind::BadInput,
            MeasureError::BadNumber { .. } => FailureKind::BadParameter,
            _ => FailureKind::Unobservable,
        };
        failure_of(kind, &error)
    }
}

impl From<NominalError> for Failure {
    fn from(error: NominalError) -> Self {
        failure_of(FailureKind::BadInput, &error)
    }
}

impl From<PlanDocumentError> for Failure {
    fn from(error: PlanDocumentError) -> Self {
        let failure = failure_of(FailureKind::BadInput, &error);
        match error {
            PlanDocumentError::Plan(error) => failure.at_entry(error.pointer),
            PlanDocumentError::Json { .. } => failure,
        }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        failure_of(FailureKind::BadInput, &error)
    }
}

/// A calibration document that cannot be used.
pub fn unusable_document(path: &Path, error: &DocumentError) -> Failure {
    let what = format!("{}: {error}", path.display());
    explained(Failure::bad_input(what), error).in_file(path)
}

/// A failure of a kind from an error: its text, remedy and chain of causes.
pub fn failure_of(kind: FailureKind, error: &dyn Remedy) -> Failure {
    explained(Failure::new(kind, error.to_string()), error)
}

/// Adds the chain of causes of an error, and its remedy.
fn explained(mut failure: Failure, error: &dyn Remedy) -> Failure {
    if let Some(cause) = error.source() {
        failure = failure.because(cause);
    }
    match error.remedy() {
        Some(remedy) => failure.remedy(remedy),
        None => failure,
    }
}
