//! The core's errors as failures: kind, place and remedy.

use std::path::Path;

use calibration::{CalibrationError, DocumentError};
use capture::{CaptureError, ImageFileError};
use metrology::MeasureError;
use scanning::{FileError, ScanError};

use crate::failure::{Failure, FailureKind};

impl From<CaptureError> for Failure {
    fn from(error: CaptureError) -> Self {
        match error {
            CaptureError::ImageUnusable { entry, path, cause } => {
                let (_, remedy) = split_remedy(&cause.to_string());
                let failure =
                    Self::bad_input(format!("image \"{}\" named by {entry} cannot be used", path.display()))
                        .in_file(&path)
                        .at_entry(entry)
                        .because(&cause);
                with_remedy(failure, remedy)
            }
            other => {
                let (what, remedy) = split_remedy(&other.to_string());
                with_remedy(behind(Self::bad_input(what), &other), remedy)
            }
        }
    }
}

impl From<ImageFileError> for Failure {
    fn from(error: ImageFileError) -> Self {
        let (what, remedy) = split_remedy(&error.to_string());
        with_remedy(behind(Self::bad_input(what), &error), remedy)
    }
}

impl From<CalibrationError> for Failure {
    fn from(error: CalibrationError) -> Self {
        if error == CalibrationError::Cancelled {
            return Self::cancelled();
        }
        let (what, remedy) = split_remedy(&error.to_string());
        let failure = match error {
            CalibrationError::OrdersUnsorted { .. } => Self::bad_input(what).at_entry("projector.orders"),
            CalibrationError::TurnMismatch { .. } | CalibrationError::MixedStages { .. } => {
                Self::bad_input(what).at_entry("stage_views")
            }
            _ => Self::unobservable(what),
        };
        with_remedy(failure, remedy)
    }
}

impl From<ScanError> for Failure {
    fn from(error: ScanError) -> Self {
        let (what, remedy) = split_remedy(&error.to_string());
        let failure = match error {
            ScanError::NoStage { .. } => Self::unobservable(what),
            _ => Self::bad_input(what),
        };
        with_remedy(failure, remedy)
    }
}

impl From<MeasureError> for Failure {
    fn from(error: MeasureError) -> Self {
        let (what, remedy) = split_remedy(&error.to_string());
        let failure = match error {
            MeasureError::CalibrationMismatch { .. } => Self::bad_input(what),
            MeasureError::BadNumber { .. } => Self::new(FailureKind::BadParameter, what),
            _ => Self::unobservable(what),
        };
        with_remedy(failure, remedy)
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        let (what, remedy) = split_remedy(&error.to_string());
        with_remedy(behind(Self::bad_input(what), &error), remedy)
    }
}

/// A calibration document that cannot be used.
pub fn unusable_document(path: &Path, error: &DocumentError) -> Failure {
    let (what, remedy) = split_remedy(&error.to_string());
    let failure = Failure::bad_input(format!("{}: {what}", path.display())).in_file(path);
    with_remedy(behind(failure, error), remedy)
}

/// A failure of that kind: what the error says, its remedy and the chain behind it.
pub fn failure_of(kind: FailureKind, error: &dyn std::error::Error) -> Failure {
    let (what, remedy) = split_remedy(&error.to_string());
    with_remedy(behind(Failure::new(kind, what), error), remedy)
}

/// The chain behind an error, without the error itself.
fn behind(failure: Failure, error: &dyn std::error::Error) -> Failure {
    match error.source() {
        Some(cause) => failure.because(cause),
        None => failure,
    }
}

/// The core's errors say what is wrong and, after the last semicolon or colon, what to do about it.
fn split_remedy(text: &str) -> (String, Option<String>) {
    match text.rsplit_once("; ").or_else(|| text.rsplit_once(": ")) {
        Some((what, remedy)) => (what.to_owned(), Some(remedy.to_owned())),
        None => (text.to_owned(), None),
    }
}

fn with_remedy(failure: Failure, remedy: Option<String>) -> Failure {
    match remedy {
        Some(remedy) => failure.remedy(remedy),
        None => failure,
    }
}
