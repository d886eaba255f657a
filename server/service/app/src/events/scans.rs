//! Bodies of the events of scans and measurements.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A scan that was stored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScanCreated {
    /// Its name.
    pub name: String,
    /// `complete`, `partial`, `invalid`.
    pub state: String,
    /// Number of points; absent without a cloud.
    pub n_points: Option<u64>,
}

/// A warning of a watch; the subject is the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WatchWarned {
    /// `lost_steps`, `wavelength`, `order_powers`, `stage_scale`.
    pub watch: String,
    /// `warning`, or `invalid`: the error exceeds the stated uncertainty of the points.
    pub state: String,
    /// Measured deviation: mm for lost steps, else relative (natural logarithm for powers).
    pub value: Option<f64>,
    /// Standard deviation of the value.
    pub sigma: Option<f64>,
    /// Stage position at which it starts.
    pub position_mm: Option<f64>,
    /// The warning as a code, as in `WatchReasonDto`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason_code: Option<String>,
    /// The warning in a sentence.
    pub reason: String,
}

/// An exported file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScanExported {
    /// The scan.
    pub scan_id: String,
    /// `cloud` or `mesh`.
    pub what: String,
    /// File format.
    pub format: String,
}

/// A characteristic that was measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementCreated {
    /// Id of the scan.
    pub scan_id: String,
    /// The tool.
    pub tool: String,
    /// Its name.
    pub name: Option<String>,
    /// The value, in `unit`; absent if not measurable.
    pub value: Option<f64>,
    /// `mm` or `°`.
    pub unit: String,
    /// Expanded uncertainty (k = 2), in `unit`.
    pub expanded_uncertainty: Option<f64>,
    /// `ok`, `not_ok`, `undecided` or `invalid`; absent without a tolerance.
    pub verdict: Option<String>,
    /// Who requested it; absent if measured in a job.
    pub actor: Option<String>,
}

/// A new version of the measurement plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MeasurementPlanChanged {
    /// Version after the change.
    pub version: u64,
    /// Who did it.
    pub actor: String,
}
