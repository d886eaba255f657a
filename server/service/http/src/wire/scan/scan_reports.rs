//! The report of a scan on the wire: read from the stored record, which has the form that `sheaf scan --json` prints.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::hardware::dark_frame::DarkFrameUseDto;
use crate::wire::scan::watches::WatchVerdictDto;

/// Report of a scan. A stopped scan has only rows and losses.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct ScanReportDto {
    /// Name of the scan in the header of the cloud.
    pub scan: String,
    /// Number of frames.
    pub n_frames: usize,
    /// Number of points in the cloud.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_points: Option<usize>,
    /// Number of detected line segments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_segments: Option<usize>,
    /// Median of the point σ along the camera ray; absent without points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median_sigma_mm: Option<f64>,
    /// Points rejected from the cloud, by reason.
    pub left_out: Vec<LeftOutDto>,
    /// Agreement of orders on surfaces that both saw.
    pub self_consistency: Vec<OrderPairDto>,
    /// Closure after a full turn of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closure: Option<ClosureDto>,
    /// Ambient light subtraction; absent if it was not requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundReportDto>,
    /// How the frames were corrected by the camera's dark frame; absent for a scan of a capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dark_frame: Option<DarkFrameUseDto>,
    /// Depth range.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub envelope: Option<EnvelopeDto>,
    /// Results of the watches; empty for turntable scans and stopped scans.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub watches: Vec<WatchVerdictDto>,
    /// HDR statistics of rows with several exposures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposures: Option<ExposuresDto>,
    /// Losses, in sentences; with any loss the scan is invalid.
    pub losses: Vec<String>,
    /// Why the scan was stopped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stopped: Option<String>,
    /// Durations of its parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timing: Option<ScanTimingDto>,
}

/// Points rejected from the cloud.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LeftOutDto {
    /// Reason: `too short`, `no hit`, `outside depth range`, `doubtful order`, `contradicted`.
    pub reason: String,
    /// Number of points.
    pub n_points: usize,
    /// Number of line segments.
    pub n_pieces: usize,
}

/// Agreement of two orders where both saw the same surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderPairDto {
    /// The lower order.
    pub order_a: i8,
    /// The higher order.
    pub order_b: i8,
    /// Number of points compared.
    pub n_pairs: usize,
    /// Mean depth of `order_b` minus `order_a` along z.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included.
    pub rms_mm: f64,
}

/// Comparison of a surface with the same surface seen one full turn later.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ClosureDto {
    /// Seen again by the same line: shows slip and drift of the table, but not axis errors. Absent if no surface was seen
    /// again by the same line.
    pub same_line: Option<ClosureGapDto>,
    /// Seen again by another line: also shows axis errors.
    pub other_lines: Option<ClosureGapDto>,
}

/// Difference of a surface after a full turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ClosureGapDto {
    /// Number of points compared.
    pub n_pairs: usize,
    /// Mean of later minus earlier along the surface normal, positive towards the axis.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included.
    pub rms_mm: f64,
    /// Pairs rejected as outliers.
    pub n_outliers: usize,
}

/// Ambient light of a scan and its subtraction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BackgroundReportDto {
    /// Level, of 255, exceeded by 5 % of the pixels of the first laser-off image.
    pub ambient_levels: Option<f64>,
    /// The same for the last laser-off image.
    pub ambient_levels_at_end: Option<f64>,
    /// Number of laser-off images.
    #[serde(alias = "n_pictures")]
    pub n_images: usize,
    /// Frames with ambient light subtracted.
    pub n_frames_with: usize,
    /// Frames processed without subtraction: the room was dark enough, or had changed.
    pub n_frames_without: usize,
}

/// Depth ranges, z of the camera frame: nearest and farthest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EnvelopeDto {
    /// Range in which points are accepted.
    #[schema(min_items = 2, max_items = 2)]
    pub stated_mm: [f64; 2],
    /// Range in which the image position of a line alone determines its order.
    #[schema(min_items = 2, max_items = 2)]
    pub unambiguous_mm: [f64; 2],
}

/// HDR statistics of rows with several exposures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ExposuresDto {
    /// Exposure times, shortest first.
    pub exposures_us: Vec<f64>,
    /// Number of line points.
    pub n_points: usize,
    /// Points saturated in some exposures and taken from others.
    pub n_replaced: usize,
    /// Points saturated in every exposure.
    pub n_saturated: usize,
    /// Points whose exposures differ by more than 3 σ: the best is used and its σ includes the difference.
    pub n_disagreeing: usize,
}

/// Durations of the parts of a scan; parts that were not run are absent.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct ScanTimingDto {
    /// Number of evaluated frames.
    pub n_frames: usize,
    /// Total number of frame reads for the evaluation.
    pub frames_read: usize,
    /// Duration from lines to a stored cloud.
    pub evaluation_s: f64,
    /// Duration from the first motion to the last row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acquisition_s: Option<f64>,
    /// Number of rows captured in this time.
    #[serde(alias = "rows_taken", skip_serializing_if = "Option::is_none")]
    pub n_rows: Option<usize>,
    /// Time in it spent neither moving nor exposing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waiting_s: Option<f64>,
    /// Frames captured per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames_per_s: Option<f64>,
    /// Latency from the arrival of a frame to its profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrival_to_profile_ms: Option<LatencyDto>,
    /// Latency from the arrival of a frame until it is written to the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrival_to_file_ms: Option<LatencyDto>,
    /// Duration of the measurements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measuring_s: Option<f64>,
    /// Number of measurements in this time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_measured: Option<usize>,
}

/// Latency of frames, ms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LatencyDto {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_background_report_of_version_0_1_is_read() {
        let stored = json!({ "ambient_levels": 12.0, "ambient_levels_at_end": null, "n_pictures": 5,
            "n_frames_with": 4, "n_frames_without": 1 });
        let report: BackgroundReportDto = serde_json::from_value(stored).unwrap();
        assert_eq!(serde_json::to_value(report).unwrap()["n_images"], 5);
    }
}
