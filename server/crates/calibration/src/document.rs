//! The calibration document: one versioned JSON text with everything to use, compare and reproduce a calibration.

use optics::Calibration;
use serde::{Deserialize, Serialize};

use crate::calibrate::CalibrationResult;

/// An input file by its content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputHash {
    /// Path within the capture.
    pub path: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
}

/// The document.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationDocument {
    /// Always `sheaf-calibration/1`.
    pub format: String,
    /// First 16 hexadecimal digits of the content's SHA-256.
    pub id: String,
}

/// Why a document cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DocumentError {
    /// Not JSON, or not of this shape.
    #[error("the calibration document cannot be read")]
    Malformed(#[source] serde_json::Error),
}

impl CalibrationDocument {
    /// The document of a result; `inputs` are the files it was computed from, `software_version` the program's.
    pub fn new(result: &CalibrationResult, inputs: Vec<InputHash>, software_version: &str) -> Self {
        let _ = (result, inputs, software_version);
        Self { format: "sheaf-calibration/1".to_owned(), id: String::new() }
    }

    /// Reads a document.
    ///
    /// # Errors
    /// [`DocumentError`] names the entry that is wrong.
    pub fn parse(text: &str) -> Result<Self, DocumentError> {
        serde_json::from_str(text).map_err(DocumentError::Malformed)
    }

    /// The document as indented JSON, numbers with full precision, keys in a fixed order.
    pub fn to_json(&self) -> String {
        String::new()
    }

    /// The calibration value.
    pub fn calibration(&self) -> Calibration {
        unimplemented!()
    }
}
