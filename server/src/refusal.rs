//! The core's errors as failures of a command: exit code, place and remedy.

use std::path::Path;

use calibration::{CalibrationError, DocumentError};
use capture::{CaptureError, ImageFileError};

use crate::failure::Failure;

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
        let (what, remedy) = split_remedy(&error.to_string());
        with_remedy(Self::unobservable(what), remedy)
    }
}

/// A calibration document that cannot be used.
pub fn unusable_document(path: &Path, error: &DocumentError) -> Failure {
    Failure::bad_input(format!("cannot use the calibration document {}", path.display()))
        .in_file(path)
        .because(error)
        .remedy("name a document written by sheaf calibrate, or calibrate again")
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
