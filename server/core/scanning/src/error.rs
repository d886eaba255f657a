//! Errors of evaluating a scan, and of reading or writing its data.

use std::borrow::Cow;
use std::io;

use optics::StagePosition;
use remedy::Remedy;

/// Why a scan cannot be evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScanError {
    /// There is nothing to evaluate.
    #[error("the scan has no frames")]
    NoFrames,
    /// The stage moved, but the calibration has no stage.
    #[error("the calibration `{calibration}` has no stage, but the scan's frames are {travel} apart")]
    NoStage {
        /// The calibration's id.
        calibration: String,
        /// Distance between the outermost positions.
        travel: StagePosition,
    },
    /// The frames were taken on another kind of stage.
    #[error(
        "the calibration `{calibration}` is for a {calibrated} stage, but frame {frame} was taken on a {found} one"
    )]
    OtherStage {
        /// The calibration's id.
        calibration: String,
        /// Kind of the calibrated stage.
        calibrated: &'static str,
        /// Index of the frame.
        frame: usize,
        /// Kind of the stage it was taken on.
        found: &'static str,
    },
    /// The calibration does not have the line that was switched on alone.
    #[error("frame {frame} shows line {line} alone, which the calibration `{calibration}` does not have")]
    UnknownLine {
        /// The calibration's id.
        calibration: String,
        /// Index of the frame.
        frame: usize,
        /// Number of the line.
        line: i8,
    },
    /// Lines were switched on one by one in some frames only.
    #[error("frame {frame} does not state which line was on, other frames do")]
    MissingLitLine {
        /// Index of the frame.
        frame: usize,
    },
    /// A stage position is not a number.
    #[error("the stage position of frame {frame} is not a finite number")]
    BadPosition {
        /// Index of the frame.
        frame: usize,
    },
    /// The depth range is empty or not a number.
    #[error("the depth range {near_mm}–{far_mm} mm is empty or not positive")]
    BadDepthRange {
        /// Nearest depth.
        near_mm: f64,
        /// Farthest depth.
        far_mm: f64,
    },
    /// A frame can no longer be read.
    #[error("frame {frame} cannot be read: {problem}")]
    UnreadableFrame {
        /// Index of the frame.
        frame: usize,
        /// Why.
        problem: String,
        /// What to do about it.
        remedy: Option<String>,
    },
}

impl Remedy for ScanError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::NoStage { .. } => "calibrate with at least three stage views".into(),
            Self::OtherStage { .. } => "use a calibration of the station that took the scan".into(),
            Self::BadDepthRange { .. } => "give near < far".into(),
            Self::UnreadableFrame { remedy, .. } => return remedy.as_deref().map(Cow::Borrowed),
            Self::UnknownLine { .. } => "use a calibration of this projector".into(),
            Self::MissingLitLine { .. } => "state the line of every frame".into(),
            Self::NoFrames | Self::BadPosition { .. } => return None,
        })
    }
}

/// Data could not be read or written in its format; the file name is not known here.
#[derive(Debug, thiserror::Error)]
pub enum ContentError {
    /// Reading or writing failed.
    #[error("input or output failed")]
    Io(#[from] io::Error),
    /// The content does not match the format.
    #[error("{place}: {problem}")]
    Malformed {
        /// Line, vertex or part of the file.
        place: String,
        /// What is wrong there.
        problem: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

impl Remedy for ContentError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::Malformed { remedy, .. } => (*remedy).into(),
            Self::Io(_) => return None,
        })
    }
}

impl ContentError {
    pub(crate) fn malformed(place: impl Into<String>, problem: impl Into<String>, remedy: &'static str) -> Self {
        Self::Malformed { place: place.into(), problem: problem.into(), remedy }
    }

    /// Converts an unexpected end of file into an error with its place; other errors are unchanged.
    pub(crate) fn truncated(cause: io::Error, place: impl FnOnce() -> String) -> Self {
        if cause.kind() != io::ErrorKind::UnexpectedEof {
            return Self::Io(cause);
        }
        Self::malformed(
            place(),
            "the file ends before all records stated in its header",
            "copy or export the file again; it is truncated or its header is wrong",
        )
    }
}
