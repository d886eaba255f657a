//! Statistics of a recording, as stored in its record.

use recording::{FrameLosses, RecordingFile};
use serde::{Deserialize, Serialize};

/// Why a recording ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
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
    /// The disk is full.
    DiskFull,
    /// Writing failed.
    WriteFailed,
    /// The service was shut down.
    ServiceEnded,
    /// The process crashed.
    Crashed,
}

impl Ended {
    /// The reason as written to the file.
    pub fn text(self) -> &'static str {
        match self {
            Self::Stopped => "stopped by a user",
            Self::LiveEnded => "the live view ended",
            Self::ScanEnded => "all frames of the scan were captured",
            Self::ScanBegan => "the recording of a scan started",
            Self::DiskFloor => "free disk space reached its lower limit",
            Self::DiskFull => "the disk is full",
            Self::WriteFailed => "writing to the disk failed",
            Self::ServiceEnded => "the service was shut down",
            Self::Crashed => "the process crashed",
        }
    }
}

/// Statistics of a recording.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RecordingFigures {
    /// Recorded frames.
    pub n_frames: u64,
    /// Missing exposures by reason.
    pub lost: FrameLosses,
    /// Number of gaps.
    pub n_gaps: u64,
    /// Recorded rows of the scan.
    pub n_rows: u64,
    /// Messages other than frames that were dropped because their queue was full.
    pub n_notes_lost: u64,
    /// From the first to the last frame.
    pub duration_s: f64,
    /// Why it ended; `None` while recording.
    pub ended: Option<Ended>,
    /// What went wrong at the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

impl RecordingFigures {
    /// From the file of a crashed process.
    pub fn of_file(file: &RecordingFile) -> Self {
        let summary = file.summary();
        Self {
            n_frames: summary.n_frames,
            lost: summary.lost,
            n_gaps: summary.gaps.len() as u64,
            n_rows: summary.n_rows,
            n_notes_lost: file.end.as_ref().map_or(0, |end| end.n_notes_lost),
            duration_s: summary.duration_s,
            ended: Some(Ended::Crashed),
            problem: None,
        }
    }
}
