//! Recordings on the wire.

use app::recordings::figures::{Ended, RecordingFigures};
use serde::{Deserialize, Serialize};
use store::{DamagedRow, RecordingRecord, RecordingState};
use utoipa::ToSchema;

use crate::wire::parse_stored;

/// Request to record the live view.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StartRecordingDto {
    /// Its name; default `live view`.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 100)]
    pub name: Option<String>,
}

/// What was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordingOriginDto {
    /// The live view.
    Live,
    /// A scan.
    Scan,
}

/// State of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordingStateDto {
    /// Recording.
    Recording,
    /// Ended; the file is being completed.
    Finishing,
    /// Complete.
    Complete,
    /// The process crashed or the end could not be written; everything readable is in the file.
    Interrupted,
    /// Nothing could be recovered.
    Failed,
}

/// Why a recording ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordingEndedDto {
    /// Stopped by a user.
    Stopped,
    /// The live view ended.
    LiveEnded,
    /// All frames of the scan were captured.
    ScanEnded,
    /// The recording of a scan started.
    ScanBegan,
    /// Free disk space reached its lower limit.
    DiskFloor,
    /// The disk was full.
    DiskFull,
    /// Writing failed.
    WriteFailed,
    /// The service was shut down.
    ServiceEnded,
    /// The process crashed.
    Crashed,
}

/// Exposures missing from a recording, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct RecordingLossesDto {
    /// Lost between sensor and driver; while recording, all frames that did not arrive.
    pub camera: u64,
    /// Packets missing.
    pub incomplete: u64,
    /// No free buffer.
    pub no_buffer: u64,
    /// Wrong size or format.
    pub malformed: u64,
    /// Received, but the recorder was too slow.
    pub recorder: u64,
}

/// A recording of camera and stage as an MCAP file.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RecordingDto {
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// What was recorded.
    pub origin: RecordingOriginDto,
    /// State.
    pub state: RecordingStateDto,
    /// The scan that was recorded; it may have been deleted.
    pub scan_id: Option<String>,
    /// The calibration stored in the file.
    pub calibration_id: Option<String>,
    /// Size of the file.
    pub size_bytes: u64,
    /// Recorded frames.
    pub n_frames: u64,
    /// Missing exposures.
    pub lost: RecordingLossesDto,
    /// Number of gaps.
    pub n_gaps: u64,
    /// Recorded rows of the scan.
    pub n_rows: u64,
    /// Messages other than frames that were dropped because their queue was full.
    pub n_notes_lost: u64,
    /// From the first to the last frame; while recording, since the start.
    pub duration_s: f64,
    /// Why it ended; absent while recording.
    pub ended: Option<RecordingEndedDto>,
    /// What went wrong at the end.
    pub problem: Option<String>,
    /// URL of the file; absent until it is complete.
    pub file: Option<String>,
    /// Time of the start, ms since 1970 (UTC).
    pub started_at_ms: i64,
}

/// URL of a recording.
pub fn recording_href(id: &str) -> String {
    format!("/api/v1/recordings/{id}")
}

impl TryFrom<RecordingRecord> for RecordingDto {
    type Error = DamagedRow;

    fn try_from(record: RecordingRecord) -> Result<Self, DamagedRow> {
        let figures: RecordingFigures = parse_stored("recording", &record.id, record.summary)?;
        let lost = figures.lost;
        Ok(Self {
            file: record.file.map(|_| format!("{}/file", recording_href(&record.id))),
            id: record.id,
            name: record.name,
            origin: if record.origin == "scan" { RecordingOriginDto::Scan } else { RecordingOriginDto::Live },
            state: record.state.into(),
            scan_id: record.scan_id,
            calibration_id: record.calibration_id,
            size_bytes: record.size_bytes,
            n_frames: figures.n_frames,
            lost: RecordingLossesDto {
                camera: lost.camera,
                incomplete: lost.incomplete,
                no_buffer: lost.no_buffer,
                malformed: lost.malformed,
                recorder: lost.recorder,
            },
            n_gaps: figures.n_gaps,
            n_rows: figures.n_rows,
            n_notes_lost: figures.n_notes_lost,
            duration_s: figures.duration_s,
            ended: figures.ended.map(RecordingEndedDto::from),
            problem: figures.problem,
            started_at_ms: record.started_at_ms,
        })
    }
}

impl From<RecordingState> for RecordingStateDto {
    fn from(state: RecordingState) -> Self {
        match state {
            RecordingState::Recording => Self::Recording,
            RecordingState::Finishing => Self::Finishing,
            RecordingState::Complete => Self::Complete,
            RecordingState::Interrupted => Self::Interrupted,
            RecordingState::Failed => Self::Failed,
        }
    }
}

impl From<Ended> for RecordingEndedDto {
    fn from(ended: Ended) -> Self {
        match ended {
            Ended::Stopped => Self::Stopped,
            Ended::LiveEnded => Self::LiveEnded,
            Ended::ScanEnded => Self::ScanEnded,
            Ended::ScanBegan => Self::ScanBegan,
            Ended::DiskFloor => Self::DiskFloor,
            Ended::DiskFull => Self::DiskFull,
            Ended::WriteFailed => Self::WriteFailed,
            Ended::ServiceEnded => Self::ServiceEnded,
            Ended::Crashed => Self::Crashed,
        }
    }
}
