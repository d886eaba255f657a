//! Summary of the content of a recording and of what is missing.

use capture::NominalPosition;

use crate::file::RecordingFile;
use crate::messages::FrameLosses;

/// Summary of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingSummary {
    /// From the first frame to the last.
    pub duration_s: f64,
    /// Frames in the file.
    pub n_frames: u64,
    /// Columns and rows of the first.
    pub size_px: Option<(usize, usize)>,
    /// Bits per pixel of the first.
    pub bits_per_pixel: Option<u32>,
    /// Missing exposures, by reason.
    pub lost: FrameLosses,
    /// Positions of missing exposures.
    pub gaps: Vec<Gap>,
    /// Rows of the scan.
    pub n_rows: u64,
    /// Rows whose frames are not in the file.
    pub n_rows_missing: u64,
    /// Messages by topic.
    pub topics: Vec<TopicCount>,
}

/// A gap in the sequence of exposures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// The previous frame, by index in the file; `None`: before the first.
    pub after_frame: Option<usize>,
    /// Stage position at the end of the gap.
    pub position: Option<NominalPosition>,
    /// Their number, by reason.
    pub lost: FrameLosses,
}

/// Messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicCount {
    /// The topic.
    pub topic: String,
    /// Number of messages.
    pub n_messages: u64,
}

impl RecordingFile {
    /// Summary of its content.
    pub fn summary(&self) -> RecordingSummary {
        let (first, last) = (self.frames.first(), self.frames.last());
        let between_ns = |(first, last): (u64, u64)| last.saturating_sub(first);
        let duration_ns = first.zip(last).map_or(0, |(first, last)| between_ns((first.at_ns, last.at_ns)));
        let mut lost = FrameLosses::default();
        let mut gaps = Vec::new();
        for (idx, frame) in self.frames.iter().enumerate() {
            lost.add(&frame.note.lost_before);
            if frame.note.lost_before.total() > 0 {
                let position = frame.note.position.known();
                gaps.push(Gap { after_frame: idx.checked_sub(1), position, lost: frame.note.lost_before });
            }
        }
        if let Some(end) = &self.end {
            lost = end.lost;
        }
        let (_, n_rows_missing) = self.scan_frames();
        RecordingSummary {
            duration_s: duration_ns as f64 * 1e-9,
            n_frames: self.frames.len() as u64,
            size_px: first.map(|frame| (frame.shape.0, frame.shape.1)),
            bits_per_pixel: first.map(|frame| frame.shape.2),
            lost,
            gaps,
            n_rows: self.rows.len() as u64,
            n_rows_missing,
            topics: self
                .n_messages
                .iter()
                .map(|(topic, n_messages)| TopicCount { topic: topic.clone(), n_messages: *n_messages })
                .collect(),
        }
    }

    /// Whether data between its first and last record are missing.
    pub fn is_lossy(&self) -> bool {
        let summary = self.summary();
        summary.lost.total() > 0
            || summary.n_rows_missing > 0
            || !self.damaged_parts.is_empty()
            || self.end.as_ref().is_some_and(|end| end.n_notes_lost > 0)
    }

    /// The frames of the scan, row by row, each with its position assigned by the scan, and the number of rows
    /// without a frame. For a recording without a scan, all frames at their own positions.
    pub fn scan_frames(&self) -> (Vec<(usize, Option<NominalPosition>)>, u64) {
        if self.rows.is_empty() {
            return (self.frames.iter().map(|frame| frame.note.position.known()).enumerate().collect(), 0);
        }
        let mut rows = self.rows.clone();
        rows.sort_by_key(|row| row.row);
        let by_sequence: std::collections::HashMap<u64, usize> =
            self.frames.iter().enumerate().map(|(idx, frame)| (frame.note.sequence, idx)).collect();
        let found: Vec<_> =
            rows.iter().filter_map(|row| Some((*by_sequence.get(&row.sequence)?, row.position.known()))).collect();
        let n_missing = (rows.len() - found.len()) as u64;
        (found, n_missing)
    }
}
