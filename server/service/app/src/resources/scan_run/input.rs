//! Source, motion, measurements and purpose of a scan, as stored.

use serde::{Deserialize, Serialize};

/// Source of the frames of a scan.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ScanSource {
    /// The station itself.
    #[default]
    Station,
    /// A scan of a capture.
    Capture {
        /// Id of the capture.
        capture_id: String,
        /// Name of the scan in the capture; `None`: the only one.
        scan: Option<String>,
    },
}

impl ScanSource {
    /// `station` or `capture`.
    pub fn label(&self) -> &'static str {
        match self {
            Self::Station => "station",
            Self::Capture { .. } => "capture",
        }
    }
}

/// Motion of the stage during a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScanMode {
    /// Stops for every frame.
    StopAndGo,
    /// Moves at constant speed.
    Continuous,
}

/// Purpose of a scan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ScanPurpose {
    /// Inspection of a part.
    #[default]
    Production,
    /// Verification of the calibration on a reference part.
    Verification,
}

/// When laser-off images are captured during a scan, for ambient light subtraction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct BackgroundInput {
    /// Stop-and-go: at least one every so many rows, default 1; an outdated one is captured
    /// again. A continuous scan has one before it, and one after it for comparison.
    pub every_rows: Option<usize>,
    /// Only if the ambient light exceeds this level, of 255; `None`: always.
    pub above_levels: Option<f64>,
}

/// A characteristic to measure on a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeasureInput {
    /// The tool's name.
    pub tool: String,
    /// Name of the characteristic; distinguishes several uses of one tool.
    #[serde(default)]
    pub name: Option<String>,
    /// Nominal value, mm (degrees for an angle).
    pub nominal_mm: Option<f64>,
    /// Symmetric tolerance around the nominal, mm (degrees for an angle); required for a verdict.
    pub tolerance_mm: Option<f64>,
    /// Only use points in this box of the part frame: x, y, z of one corner, x, y, z of the other.
    #[serde(default)]
    pub region_mm: Option<[f64; 6]>,
    /// Random seed of the search; default 1.
    #[serde(default)]
    pub seed: Option<u64>,
}
