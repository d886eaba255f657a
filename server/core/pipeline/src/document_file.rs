//! Calibration documents as files.

use std::path::Path;

use calibration::CalibrationDocument;

use crate::failure::Failure;
use crate::refusal::unusable_document;

/// Reads a calibration document.
pub fn read_document(path: &Path) -> Result<CalibrationDocument, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        Failure::bad_input(format!("cannot read the calibration document {}", path.display()))
            .in_file(path)
            .because(&error)
            .remedy("use a document written by sheaf calibrate")
    })?;
    CalibrationDocument::parse(&text).map_err(|error| unusable_document(path, &error))
}
