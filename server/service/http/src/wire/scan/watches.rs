//! What the watches over the station say, on the wire.

use app::watches::{WatchHistory, WatchReading};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A watch over the station.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WatchDto {
    /// A jump between what the orders saw before and after; mm.
    LostSteps,
    /// Relative change of λ/d since the calibration.
    Wavelength,
    /// Logarithm of how much the power of an order has changed since the first scans after the calibration.
    OrderPowers,
    /// What the stage travels more than it says, relative.
    StageScale,
}

/// What a watch says of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WatchStateDto {
    /// Nothing beyond doubt.
    Quiet,
    /// This part shows nothing of it.
    Blind,
    /// Something is beyond doubt.
    Warning,
    /// The error exceeds the uncertainty that the points state: the scan is invalid.
    Invalid,
}

/// What one watch says of a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WatchVerdictDto {
    /// Which.
    pub watch: WatchDto,
    /// Whether all is well.
    pub state: WatchStateDto,
    /// Its figure, in the unit of the watch; missing where it is blind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// One σ of the figure; of lost steps that were not noticed, the smallest loss that would have been, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// The error of points that it causes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_mm: Option<f64>,
    /// The stage position where it begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// In words, with what to do.
    pub reason: String,
}

/// What the watches said of one scan.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WatchReadingDto {
    /// The scan; it may be deleted by now.
    pub scan_id: String,
    /// What people called it.
    pub scan_name: String,
    /// The calibration it was computed with.
    pub calibration_id: String,
    /// When it was made, ms since 1970.
    pub at_ms: i64,
    /// One verdict for every watch.
    pub verdicts: Vec<WatchVerdictDto>,
}

/// The last scans of the station, as the watches saw them.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WatchHistoryDto {
    /// Oldest first; at most 300 are kept.
    pub readings: Vec<WatchReadingDto>,
    /// Scans with the newest reading's calibration that were taken for normal powers.
    pub n_reference_scans: usize,
    /// How many it takes.
    pub n_reference_scans_needed: usize,
}

impl From<WatchHistory> for WatchHistoryDto {
    fn from(history: WatchHistory) -> Self {
        let newest = history.readings.last();
        let n_reference_scans = newest.map_or(0, |newest| history.n_reference_scans(&newest.calibration_id));
        let reading = |WatchReading { scan_id, scan_name, calibration_id, at_ms, verdicts }| WatchReadingDto {
            scan_id,
            scan_name,
            calibration_id,
            at_ms,
            // A form that another version stored counts as nothing said.
            verdicts: serde_json::from_value(verdicts).unwrap_or_default(),
        };
        Self {
            n_reference_scans,
            n_reference_scans_needed: app::watches::REFERENCE_SCANS,
            readings: history.readings.into_iter().map(reading).collect(),
        }
    }
}
