//! A recording in figures, as its record keeps them.

use recording::{FrameLosses, RecordingFile};
use serde::{Deserialize, Serialize};

/// Why a recording ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// A person ended it.
    Stopped,
    /// The live view has ended.
    LiveEnded,
    /// The frames of the scan are taken.
    ScanEnded,
    /// A scan is recorded instead.
    ScanBegan,
    /// The disk has no more room than must stay free.
    DiskFloor,
    /// The disk is full.
    DiskFull,
    /// Writing failed.
    WriteFailed,
    /// The service has ended.
    ServiceEnded,
    /// The process crashed.
    Crashed,
}

impl Ended {
    /// In the words of the file.
    pub fn words(self) -> &'static str {
        match self {
            Self::Stopped => "stopped by a person",
            Self::LiveEnded => "the live view has ended",
            Self::ScanEnded => "the frames of the scan are taken",
            Self::ScanBegan => "a scan is recorded instead",
            Self::DiskFloor => "the disk has no more room than must stay free",
            Self::DiskFull => "the disk is full",
            Self::WriteFailed => "the disk did not take it",
            Self::ServiceEnded => "the service has ended",
            Self::Crashed => "the process died",
        }
    }
}

/// A recording in figures.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RecordingFigures {
    /// Recorded frames.
    pub n_frames: u64,
    /// Exposures that are not in it, by reason.
    pub lost: FrameLosses,
    /// Number of gaps.
    pub n_gaps: u64,
    /// Rows of a scan.
    pub n_rows: u64,
    /// Messages beside the frames that found no room.
    pub n_notes_lost: u64,
    /// From the first frame to the last.
    pub duration_s: f64,
    /// Why it ended; `None` while it goes on.
    pub ended: Option<Ended>,
    /// What went wrong at the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

impl RecordingFigures {
    /// Of a file that a dead process left.
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
