//! The calibration document: versioned JSON with everything needed to use, compare and reproduce a calibration.
//!
//! It contains no time stamp: identical inputs give identical bytes, and the id is the hash of the content.

mod check;
mod text;
mod value;

use std::borrow::Cow;

use optics::Calibration;
use remedy::Remedy;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::calibrate::CalibrationResult;

pub use crate::findings::document_report::{
    AxisSummary, CameraSummary, LightSummary, LineSummary, ReportText, StageSummary,
};
pub use text::{
    AxisText, CalibrationText, CameraText, CovarianceText, DepthRangeText, LightText, PlaneText, RotaryTag,
    StageText, StraightnessText, TravelText,
};

/// The only format this version reads and writes.
pub const FORMAT: &str = "sheaf-calibration/1";

/// Hexadecimal digits of the content's hash used as the id.
const ID_DIGITS: usize = 16;

/// An input file, identified by its content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputHash {
    /// Path within the capture.
    pub path: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
}

/// The program that created the document.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Software {
    /// `sheaf`.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// The whole document.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationDocument {
    /// The calibration itself.
    #[serde(flatten)]
    pub calibration: CalibrationText,
    /// The program that created it.
    pub software: Software,
    /// The files it was computed from.
    pub inputs: Vec<InputHash>,
    /// Constants of the computation that affect the result.
    pub parameters: std::collections::BTreeMap<String, f64>,
    /// Residuals, cross-validation, warnings.
    pub report: ReportText,
}

/// Why a document cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DocumentError {
    /// Not JSON, or not of this shape.
    #[error("the calibration document cannot be read")]
    Malformed(#[source] serde_json::Error),
    /// Another format.
    #[error("the calibration document has format `{found}`, this program reads `{FORMAT}`")]
    Format {
        /// As found.
        found: String,
    },
    /// A number is missing or invalid.
    #[error("the calibration document's `{entry}` {problem}")]
    Entry {
        /// The entry.
        entry: &'static str,
        /// What is wrong.
        problem: &'static str,
    },
}

impl Remedy for DocumentError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some("create it again with `sheaf calibrate`".into())
    }
}

impl CalibrationDocument {
    /// The document of a result; `inputs` are the files it was computed from, `software_version` the program's.
    pub fn new(result: &CalibrationResult, inputs: Vec<InputHash>, software_version: &str) -> Self {
        let mut document = Self {
            calibration: CalibrationText::of(&result.calibration),
            software: Software { name: "sheaf".to_owned(), version: software_version.to_owned() },
            inputs,
            parameters: crate::params::as_map(),
            report: ReportText::of(&result.report),
        };
        document.name_by_content();
        document
    }

    /// The same document with another calibration, whose stage was determined from the additional `inputs`. `how`
    /// describes the method and is added to the warnings.
    pub fn with_stage_of(&self, calibration: &Calibration, how: &str, inputs: Vec<InputHash>) -> Self {
        let mut document = Self { calibration: CalibrationText::of(calibration), ..self.clone() };
        document.inputs.extend(inputs);
        (document.report.stage, document.report.axis) = (None, None);
        document.report.warnings.push(how.to_owned());
        document.name_by_content();
        document
    }

    /// Sets the id to the hash of everything else.
    fn name_by_content(&mut self) {
        self.calibration.id = String::new();
        let digest = Sha256::digest(self.to_json().as_bytes());
        self.calibration.id =
            digest.iter().map(|byte| format!("{byte:02x}")).collect::<String>()[..ID_DIGITS].to_owned();
    }

    /// Reads a document.
    ///
    /// # Errors
    /// [`DocumentError`] names the entry that is wrong.
    pub fn parse(text: &str) -> Result<Self, DocumentError> {
        let document: Self = serde_json::from_str(text).map_err(DocumentError::Malformed)?;
        document.calibration.check()?;
        Ok(document)
    }

    /// The document as indented JSON, numbers with full precision, keys in a fixed order.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a document of numbers and strings always has a JSON form")
    }

    /// The calibration value.
    pub fn calibration(&self) -> Calibration {
        self.calibration.value()
    }
}
