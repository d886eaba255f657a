//! Captures on the wire.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use store::{CaptureRecord, DamagedRow};
use utoipa::ToSchema;

use crate::wire::parse_stored;

/// Origin of a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CaptureOriginDto {
    /// Uploaded by a client.
    Upload,
    /// Captured for a calibration.
    Calibration,
    /// The frames of a scan.
    Scan,
}

/// A set of images with its manifest.
#[derive(Debug, Serialize, ToSchema)]
pub struct CaptureDto {
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Origin.
    pub origin: CaptureOriginDto,
    /// Size of the archive.
    pub size_bytes: u64,
    /// Summary of the manifest.
    pub summary: CaptureSummaryDto,
    /// URL of the archive.
    pub archive: String,
    /// Time of creation, ms since 1970 (UTC).
    pub created_at_ms: i64,
}

/// Content of a capture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CaptureSummaryDto {
    /// Image width.
    pub width_px: usize,
    /// Image height.
    pub height_px: usize,
    /// Number of board poses.
    pub n_poses: usize,
    /// Poses with a laser image.
    pub n_laser_poses: usize,
    /// Number of stage views.
    pub n_stage_views: usize,
    /// Its scans.
    pub scans: Vec<CaptureScanDto>,
    /// Unpacked size.
    pub unpacked_bytes: u64,
    /// Warnings, in sentences.
    pub warnings: Vec<String>,
}

/// A scan of a capture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CaptureScanDto {
    /// Its name.
    pub name: String,
    /// Number of frames.
    pub n_frames: usize,
    /// Lowest position of a linear stage; absent without frames.
    pub from_mm: Option<f64>,
    /// Highest position of a linear stage; absent without frames.
    pub to_mm: Option<f64>,
    /// Lowest angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Highest angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
}

/// URL of a capture.
pub fn capture_href(id: &str) -> String {
    format!("/api/v1/captures/{id}")
}

impl TryFrom<CaptureRecord> for CaptureDto {
    type Error = DamagedRow;

    fn try_from(record: CaptureRecord) -> Result<Self, DamagedRow> {
        let summary = parse_stored("capture", &record.id, record.summary)?;
        let origin = parse_stored("capture", &record.id, Value::String(record.origin))?;
        Ok(Self {
            archive: format!("{}/archive", capture_href(&record.id)),
            id: record.id,
            name: record.name,
            origin,
            size_bytes: record.size_bytes,
            summary,
            created_at_ms: record.created_at_ms,
        })
    }
}
