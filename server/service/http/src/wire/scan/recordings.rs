//! Recordings on the wire.

use app::recordings::figures::{Ended, RecordingFigures};
use serde::{Deserialize, Serialize};
use store::{DamagedRow, RecordingRecord, RecordingState};
use utoipa::ToSchema;

use crate::wire::figures;

/// Record the live view.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StartRecordingDto {
    /// What a person calls it; `live view` if not said.
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

/// Where a recording is in its life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordingStateDto {
    /// Frames are added.
    Recording,
    /// It has ended, and its file is being finished.
    Finishing,
    /// It ended as it should, whatever ended it.
    Complete,
    /// The process died, or the disk did not take its end; what could be read is in the file.
    Interrupted,
    /// Nothing of it can be read.
    Failed,
}

/// Why a recording ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordingEndedDto {
    /// A person stopped it.
    Stopped,
    /// The live view ended.
    LiveEnded,
    /// The frames of the scan were taken.
    ScanEnded,
    /// A scan was recorded instead.
    ScanBegan,
    /// The disk had no more room than must stay free.
    DiskFloor,
    /// The disk was full.
    DiskFull,
    /// The disk did not take it.
    WriteFailed,
    /// The service ended.
    ServiceEnded,
    /// The process died.
    Crashed,
}

/// Exposures that are not in a recording, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
pub struct RecordingLossesDto {
    /// Lost between sensor and driver. While it runs, all that did not arrive.
    pub camera: u64,
    /// Packets of them were missing.
    pub incomplete: u64,
    /// There was no free buffer.
    pub no_buffer: u64,
    /// They came with another size or format.
    pub malformed: u64,
    /// They arrived, and the recorder did not take them in time.
    pub recorder: u64,
}

/// What camera and stage delivered, as an MCAP file.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RecordingDto {
    /// Its id.
    pub id: String,
    /// What a person calls it.
    pub name: String,
    /// What was recorded.
    pub origin: RecordingOriginDto,
    /// Where it is in its life.
    pub state: RecordingStateDto,
    /// The scan that was recorded; it may have been deleted.
    pub scan_id: Option<String>,
    /// The calibration whose document is in the file.
    pub calibration_id: Option<String>,
    /// Bytes of the file.
    pub size_bytes: u64,
    /// Frames in it.
    pub n_frames: u64,
    /// Exposures that are not in it.
    pub lost: RecordingLossesDto,
    /// Places where they are missing.
    pub n_gaps: u64,
    /// Rows of the scan in it.
    pub n_rows: u64,
    /// Messages beside the frames that found no room in their queue.
    pub n_notes_lost: u64,
    /// From the first frame to the last; while it runs, since it began.
    pub duration_s: f64,
    /// Why it ended; missing while it runs.
    pub ended: Option<RecordingEndedDto>,
    /// What went wrong at its end.
    pub problem: Option<String>,
    /// Address of the file; missing until it is finished.
    pub file: Option<String>,
    /// When it began, wall clock, ms since 1970.
    pub started_at_ms: i64,
}

/// Address of a recording.
pub fn recording_href(id: &str) -> String {
    format!("/api/v1/recordings/{id}")
}

impl TryFrom<RecordingRecord> for RecordingDto {
    type Error = DamagedRow;

    fn try_from(record: RecordingRecord) -> Result<Self, DamagedRow> {
        let figures: RecordingFigures = figures("recording", &record.id, record.summary)?;
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
