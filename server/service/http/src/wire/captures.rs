//! Captures on the wire.

use serde::Serialize;
use serde_json::Value;
use store::CaptureRecord;
use utoipa::ToSchema;

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
    pub summary: Value,
    /// Address of the archive.
    pub archive: String,
    /// When it came, wall clock, ms since 1970.
    pub created_at_ms: i64,
}

/// Address of a capture.
pub fn capture_href(id: &str) -> String {
    format!("/api/v1/captures/{id}")
}

impl From<CaptureRecord> for CaptureDto {
    fn from(record: CaptureRecord) -> Self {
        Self {
            archive: format!("{}/archive", capture_href(&record.id)),
            id: record.id,
            name: record.name,
            origin: record.origin,
            size_bytes: record.size_bytes,
            summary: record.summary,
            created_at_ms: record.created_at_ms,
        }
    }
}
