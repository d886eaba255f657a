//! Results of the watches on the wire.

use app::watches::{WatchHistory, WatchReading};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A watch: a continuous check of the station on every scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WatchDto {
    /// Lost steps: a jump between the surfaces seen by different orders, mm.
    LostSteps,
    /// Relative change of λ/d since the calibration.
    Wavelength,
    /// Change of the power of an order since the first scans after the calibration, natural logarithm.
    OrderPowers,
    /// Relative scale error of the stage: actual travel over reported travel, minus 1.
    StageScale,
}

/// State of a watch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WatchStateDto {
    /// No significant deviation.
    Quiet,
    /// This part does not allow the check.
    Blind,
    /// A significant deviation.
    Warning,
    /// The error exceeds the uncertainty that the points state: the scan is invalid.
    Invalid,
}

/// Why a watch has its state, as a code that clients translate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WatchReasonDto {
    /// The stage lost steps.
    StepsLost,
    /// No steps were lost.
    NoStepsLost,
    /// Lost steps cannot be detected: no changing slopes seen by two orders.
    LossUndetectable,
    /// Too few places were seen by two orders.
    LittleOverlap,
    /// The light model has no wavelength.
    NoWavelength,
    /// No significant change of the wavelength.
    WavelengthStable,
    /// The wavelength changed; the scan is corrected.
    WavelengthCorrected,
    /// The wavelength changed, or the stage is tilted; not corrected.
    WavelengthOrTilt,
    /// The part has no changing slopes along the travel.
    NoSlopes,
    /// No significant error of the stage scale.
    ScaleStable,
    /// The scale of the stage is wrong.
    ScaleWrong,
    /// Too few places were seen by two orders without saturation.
    LittleUnsaturatedOverlap,
    /// The reference powers are still being measured.
    ReferenceIncomplete,
    /// No significant change of the order powers.
    PowersStable,
    /// Positive and negative orders changed in opposite directions: the grating rotated.
    GratingRotated,
    /// Positive and negative orders changed equally: the grating is dirty.
    GratingDirty,
    /// Independent lines: one lost power against the others (`line`); its laser fades or is dirty.
    LineFaded,
    /// Independent lines: all but one (`line`) lost power against it; their lasers fade or are dirty.
    OthersFaded,
    /// All orders lost power: the laser ages, or the parts are darker.
    PowerLoss,
    /// The watch compares light sheets, and the calibration has one.
    OneLine,
}

/// Result of one watch on a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WatchVerdictDto {
    /// The watch.
    pub watch: WatchDto,
    /// Its state.
    pub state: WatchStateDto,
    /// Measured deviation, in the unit of the watch; absent if `blind`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Standard deviation of the value; if no lost steps were detected, the smallest detectable loss, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma: Option<f64>,
    /// Point error caused by the deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_mm: Option<f64>,
    /// Stage position at which it starts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<f64>,
    /// The line concerned, if it is one: of independent lines, the one whose power changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<i8>,
    /// Why, as a code; absent in results of version 0.1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason_code: Option<WatchReasonDto>,
    /// The result in a sentence, with the remedy.
    pub reason: String,
}

/// Results of all watches on one scan.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WatchReadingDto {
    /// The scan; it may have been deleted.
    pub scan_id: String,
    /// Name of the scan.
    pub scan_name: String,
    /// The calibration it was computed with.
    pub calibration_id: String,
    /// Time of the scan, ms since 1970 (UTC).
    pub at_ms: i64,
    /// One result per watch.
    pub verdicts: Vec<WatchVerdictDto>,
}

/// Results of the watches on the recent scans of the station.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WatchHistoryDto {
    /// Oldest first, at most 300.
    pub readings: Vec<WatchReadingDto>,
    /// Scans with the current calibration used so far as the reference for the order powers.
    pub n_reference_scans: usize,
    /// Scans needed for the reference.
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
            // An entry in the format of another version counts as missing.
            verdicts: serde_json::from_value(verdicts).unwrap_or_default(),
        };
        Self {
            n_reference_scans,
            n_reference_scans_needed: app::watches::REFERENCE_SCANS,
            readings: history.readings.into_iter().map(reading).collect(),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use scanning::WatchReason;
    use serde_json::json;

    use super::*;

    #[test]
    fn every_reason_has_a_code_on_the_wire() {
        for reason in WatchReason::ALL {
            let dto: WatchReasonDto = serde_json::from_value(json!(reason.code())).unwrap();
            assert_eq!(serde_json::to_value(dto).unwrap(), reason.code());
        }
    }

    #[test]
    fn a_stored_result_of_version_0_1_is_read_without_a_code() {
        let stored = json!({ "watch": "wavelength", "state": "blind", "reason": "no second order" });
        let verdict: WatchVerdictDto = serde_json::from_value(stored).unwrap();
        assert_eq!((verdict.reason_code, verdict.reason.as_str()), (None, "no second order"));
    }
}
