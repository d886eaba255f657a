//! What can go wrong with a recording.

use std::borrow::Cow;
use std::path::PathBuf;

use remedy::Remedy;

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read or written.
    #[error("cannot {act} {}", path.display())]
    File {
        /// `open`, `read`, `write`.
        act: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the system says.
        #[source]
        cause: std::io::Error,
    },
    /// It is no MCAP file.
    #[error("{} is no MCAP file", path.display())]
    NotMcap {
        /// Which file.
        path: PathBuf,
    },
    /// It is MCAP, but no recording of a station.
    #[error("{} is no recording of a station: {reason}", path.display())]
    NotARecording {
        /// Which file.
        path: PathBuf,
        /// What is missing or wrong.
        reason: String,
    },
    /// What is to be written does not fit the format.
    #[error("the recording cannot be written")]
    Mcap(#[from] mcap::McapError),
    /// A frame cannot be read.
    #[error("frame {sequence} of the recording cannot be read: {reason}")]
    Frame {
        /// The station's count of it.
        sequence: u64,
        /// What is wrong.
        reason: String,
    },
    /// There is nothing to make a capture of.
    #[error("the recording holds no frame with a stage position")]
    NothingToExport,
    /// The capture folder cannot be written.
    #[error("the capture folder cannot be written")]
    Capture(#[from] capture::CaptureError),
    /// A picture cannot be written.
    #[error("a picture of the capture cannot be written")]
    Picture(#[from] capture::ImageFileError),
}

impl RecordingError {
    /// Whether the disk had no room.
    pub fn is_full_disk(&self) -> bool {
        let io = match self {
            Self::File { cause, .. } | Self::Mcap(mcap::McapError::Io(cause)) => cause,
            _ => return false,
        };
        matches!(io.kind(), std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded)
    }
}

impl Remedy for RecordingError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::NotMcap { .. } => "give an .mcap file",
            Self::NotARecording { .. } => "give a file that a station recorded",
            Self::Frame { .. } => "repair the recording first: sheaf recording repair",
            Self::NothingToExport => "record a scan, or a live view with the stage homed",
            error if error.is_full_disk() => "make room on the disk",
            _ => return None,
        }))
    }
}
