//! Bodies of the events of captures, models, recordings, calibrations and sessions.

use serde::{Deserialize, Serialize};
use store::CaptureRecord;
use utoipa::ToSchema;

/// A capture that was uploaded or recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CaptureCreated {
    /// Its name.
    pub name: String,
    /// `upload`, `calibration`, `scan`.
    pub origin: String,
}

impl From<&CaptureRecord> for CaptureCreated {
    fn from(record: &CaptureRecord) -> Self {
        Self { name: record.name.clone(), origin: record.origin.clone() }
    }
}

/// A CAD model that was uploaded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ModelCreated {
    /// Name of its file.
    pub name: String,
    /// SHA-256 of the file, by which plans name it.
    pub sha256: String,
    /// Who uploaded it.
    pub actor: String,
}

/// A recording that was started.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingStarted {
    /// Its name.
    pub name: String,
    /// The recorded scan; absent for a live view.
    pub scan_id: Option<String>,
    /// Who started it; absent if a job did.
    pub actor: Option<String>,
}

/// A recording that has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RecordingEnded {
    /// Its name.
    pub name: String,
    /// `complete`, `interrupted`, `failed`.
    pub state: String,
    /// `stopped`, `live_ended`, `scan_ended`, `scan_began`, `disk_floor`, `disk_full`, `write_failed`, `service_ended`,
    /// `crashed`.
    pub ended: String,
    /// Recorded frames.
    pub n_frames: u64,
    /// Missing exposures.
    pub n_lost: u64,
    /// Size of the file.
    pub size_bytes: u64,
}

/// A calibration that was computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CalibrationCreated {
    /// The job that computed it.
    pub job_id: String,
    /// Model of the light sheets; absent without laser images.
    pub model: Option<String>,
    /// RMS reprojection error of the board corners.
    pub corner_rms_px: f64,
    /// Systematic depth uncertainty over the working volume, 1 σ.
    pub systematic_sigma_mm: Option<f64>,
}

/// A change of the active calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Activation {
    /// The active calibration; absent: none.
    pub calibration_id: Option<String>,
    /// The previously active calibration.
    pub previous_id: Option<String>,
    /// Who did it.
    pub actor: String,
    /// Verdict of its latest verification, if any.
    pub verification: Option<String>,
}

/// A new version of a session or a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SessionVersion {
    /// Who did it.
    pub actor: String,
    /// Version after the change.
    pub version: i64,
}
