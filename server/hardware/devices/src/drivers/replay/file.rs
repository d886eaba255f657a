//! The frames of a recording in an MCAP file.

use std::path::Path;

use recording::RecordingFile;
use vision::GreyImage;

use super::ReplayError;
use super::sequence::{RecordedFrame, Source};
use crate::StageKind;

/// A recording, with the frames that are played: those of its scan, or all.
pub struct File {
    recording: RecordingFile,
    frames: Vec<usize>,
    stage: StageKind,
}

impl File {
    /// Indexes a recording; an interrupted one is played up to its end.
    pub fn open(path: &Path) -> Result<(Self, Vec<RecordedFrame>), ReplayError> {
        let recording = RecordingFile::open(path)?;
        for damage in &recording.damaged_parts {
            tracing::warn!(at_bytes = damage.at_bytes, "the recording is damaged: {}", damage.reason);
        }
        let (frames, n_missing) = recording.scan_frames();
        if n_missing > 0 {
            tracing::warn!(n_missing, "rows of the scan are not in the recording");
        }
        let Some((first, _)) = frames.first() else {
            return Err(ReplayError::NoImages { path: path.to_owned(), images: "frames" });
        };
        let shape = recording.frames[*first].shape;
        if let Some((other, _)) = frames.iter().find(|(idx, _)| recording.frames[*idx].shape != shape) {
            return Err(ReplayError::OtherSize { path: path.to_owned(), frame_idx: *other });
        }
        let recorded_frame = |(idx, position): &(usize, Option<capture::NominalPosition>)| {
            let note = &recording.frames[*idx].note;
            let position_mm = position.map(capture::NominalPosition::value);
            RecordedFrame { position_mm, exposure_us: note.exposure_us, lost_before: note.lost_before.total() }
        };
        let turns =
            frames.iter().any(|(_, position)| matches!(position, Some(capture::NominalPosition::AngleDeg(_))));
        let stage = if turns { StageKind::Rotary } else { StageKind::Linear };
        let recorded = frames.iter().map(recorded_frame).collect();
        Ok((Self { stage, frames: frames.into_iter().map(|(idx, _)| idx).collect(), recording }, recorded))
    }
}

impl Source for File {
    fn name(&self) -> String {
        self.recording.header.name.clone()
    }

    fn stage(&self) -> StageKind {
        self.stage
    }

    fn read_into(&self, idx: usize, target: &mut GreyImage) -> Result<(), ReplayError> {
        Ok(self.recording.read_into(self.frames[idx], target)?)
    }

    fn same_as(&self, idx: usize) -> usize {
        idx
    }
}
