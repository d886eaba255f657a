//! Captures on the wire.

use serde::{Deserialize, Serialize};
use store::{CaptureRecord, DamagedRow};
use utoipa::ToSchema;

use crate::wire::figures;

/// Recorded pictures with their manifest.
#[derive(Debug, Serialize, ToSchema)]
pub struct CaptureDto {
    /// Its id.
    pub id: String,
    /// What a person calls it.
    pub name: String,
    /// `upload`, `calibration`, `scan`.
    pub origin: String,
    /// Bytes of the archive.
    pub size_bytes: u64,
    /// Counts and names from the manifest.
    pub summary: CaptureSummaryDto,
    /// Address of the archive.
    pub archive: String,
    /// When it came, wall clock, ms since 1970.
    pub created_at_ms: i64,
}

/// What a capture holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CaptureSummaryDto {
    /// Columns of the pictures.
    pub width_px: usize,
    /// Rows of the pictures.
    pub height_px: usize,
    /// Poses of the board.
    pub n_poses: usize,
    /// Of them with a laser picture.
    pub n_laser_poses: usize,
    /// Board pictures on the moving stage.
    pub n_stage_views: usize,
    /// Its scans.
    pub scans: Vec<CaptureScanDto>,
    /// Bytes of its files.
    pub unpacked_bytes: u64,
    /// What to know about it, in sentences.
    pub warnings: Vec<String>,
}

/// A scan of a capture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CaptureScanDto {
    /// Its name.
    pub name: String,
    /// Its frames.
    pub n_frames: usize,
    /// Lowest position of a stage that travels; missing without frames.
    pub from_mm: Option<f64>,
    /// Highest position of a stage that travels; missing without frames.
    pub to_mm: Option<f64>,
    /// Lowest angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_deg: Option<f64>,
    /// Highest angle of a turntable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_deg: Option<f64>,
}

/// Address of a capture.
pub fn capture_href(id: &str) -> String {
    format!("/api/v1/captures/{id}")
}

impl TryFrom<CaptureRecord> for CaptureDto {
    type Error = DamagedRow;

    fn try_from(record: CaptureRecord) -> Result<Self, DamagedRow> {
        let summary = figures("capture", &record.id, record.summary)?;
        Ok(Self {
            archive: format!("{}/archive", capture_href(&record.id)),
            id: record.id,
            name: record.name,
            origin: record.origin,
            size_bytes: record.size_bytes,
            summary,
            created_at_ms: record.created_at_ms,
        })
    }
}
