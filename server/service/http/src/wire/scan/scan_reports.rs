//! What a scan gave, on the wire: read from the record, which keeps the figures as `sheaf scan --json` prints them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::wire::scan::watches::WatchVerdictDto;

/// Figures of a scan. One that was stopped has rows and losses alone.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct ScanReportDto {
    /// What the cloud's header calls it.
    pub scan: String,
    /// Frames it was made of.
    pub n_frames: usize,
    /// Points of the cloud.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_points: Option<usize>,
    /// Pieces of lines that were found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_segments: Option<usize>,
    /// Median of the points' own σ along the camera ray; missing without points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub median_sigma_mm: Option<f64>,
    /// What was left out of the cloud, by reason.
    pub left_out: Vec<LeftOutDto>,
    /// How orders agree that saw the same surface.
    pub self_consistency: Vec<OrderPairDto>,
    /// How well the surface closes after a whole turn of a turntable.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closure: Option<ClosureDto>,
    /// What was taken away from the frames; missing if nothing was asked to be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<BackgroundReportDto>,
    /// Depths that can be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub envelope: Option<EnvelopeDto>,
    /// What the watches over the station say; none for scans of a turntable, and those that were stopped.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub watches: Vec<WatchVerdictDto>,
    /// How rows with several exposures became lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposures: Option<ExposuresDto>,
    /// What was lost, in sentences; with any of it the scan is invalid.
    pub losses: Vec<String>,
    /// Why it was stopped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stopped: Option<String>,
    /// How long its parts took.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timing: Option<ScanTimingDto>,
}

/// Points that are not in the cloud.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LeftOutDto {
    /// Why: `too short`, `no hit`, `outside depth range`, `doubtful order`, `contradicted`.
    pub reason: String,
    /// How many points.
    pub n_points: usize,
    /// Of how many pieces of lines.
    pub n_pieces: usize,
}

/// How two orders agree where both saw the same surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OrderPairDto {
    /// The lower order.
    pub order_a: i8,
    /// The higher order.
    pub order_b: i8,
    /// Points compared.
    pub n_pairs: usize,
    /// Mean depth of `order_b` minus `order_a` along z.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included.
    pub rms_mm: f64,
}

/// The surface seen first against the same seen a turn later.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ClosureDto {
    /// By the same line: slip of the table, drift; blind to the axis. Missing if no place was seen again by its line.
    pub same_line: Option<ClosureGapDto>,
    /// By another line: shows an error of the axis, too.
    pub other_lines: Option<ClosureGapDto>,
}

/// How far apart a surface is after a turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ClosureGapDto {
    /// Points compared.
    pub n_pairs: usize,
    /// Mean of later minus earlier along the surface's normal, positive towards the axis.
    pub bias_mm: f64,
    /// Root mean square of these differences, bias included.
    pub rms_mm: f64,
    /// Pairs left out as they are farther apart than all others.
    pub n_outliers: usize,
}

/// The ambient light of a scan, and how many frames were freed from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BackgroundReportDto {
    /// The level, of 255, that a twentieth of the first picture with the laser off exceeds.
    pub ambient_levels: Option<f64>,
    /// The same of the last one.
    pub ambient_levels_at_end: Option<f64>,
    /// Pictures with the laser off.
    pub n_pictures: usize,
    /// Frames that one of them was taken away from.
    pub n_frames_with: usize,
    /// Frames in which lines were looked for as they are: the room was dark enough, or had changed.
    pub n_frames_without: usize,
}

/// Depths, z of the camera frame: nearest and farthest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct EnvelopeDto {
    /// In which points are taken.
    #[schema(min_items = 2, max_items = 2)]
    pub stated_mm: [f64; 2],
    /// In which a line's image position alone determines its order.
    #[schema(min_items = 2, max_items = 2)]
    pub unambiguous_mm: [f64; 2],
}

/// How rows with several exposures became lines.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ExposuresDto {
    /// The exposures, the shortest first.
    pub exposures_us: Vec<f64>,
    /// Points of lines.
    pub n_points: usize,
    /// Of these, points that some exposure saw saturated, and that stand on others.
    pub n_replaced: usize,
    /// Points that every exposure saw saturated.
    pub n_saturated: usize,
    /// Points on which exposures differ by more than 3 σ: the best is taken, and its σ holds the difference.
    pub n_disagreeing: usize,
}

/// How long the parts of a scan took; what was not done is missing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct ScanTimingDto {
    /// Frames that were evaluated.
    pub n_frames: usize,
    /// How often a frame was read for that, all together.
    pub frames_read: usize,
    /// From lines to a stored cloud.
    pub evaluation_s: f64,
    /// From the first motion to the last row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acquisition_s: Option<f64>,
    /// Rows that were taken in this time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows_taken: Option<usize>,
    /// Of that neither motion nor exposure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waiting_s: Option<f64>,
    /// Frames that were recorded in a second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames_per_s: Option<f64>,
    /// From the arrival of a frame to its profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrival_to_profile_ms: Option<DelaysDto>,
    /// From the arrival of a frame to its place in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arrival_to_file_ms: Option<DelaysDto>,
    /// How long it was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measuring_s: Option<f64>,
    /// Measurements that were taken in this time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n_measured: Option<usize>,
}

/// Delays of frames, ms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DelaysDto {
    /// Half of them took no longer.
    pub p50: f64,
    /// All but one in a hundred took no longer.
    pub p99: f64,
    /// The longest.
    pub max: f64,
}
