//! Errors of recordings.

use std::borrow::Cow;
use std::path::PathBuf;

use remedy::Remedy;

/// Why a recording cannot be written, read or exported.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read or written.
    #[error("cannot {action} {}", path.display())]
    File {
        /// `open`, `read`, `write`.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        #[source]
        cause: std::io::Error,
    },
    /// Not an MCAP file.
    #[error("{} is not an MCAP file", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// An MCAP file, but not a recording of a station.
    #[error("{} is not a recording of a station: {reason}", path.display())]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What is missing or wrong.
        reason: String,
    },
    /// The data to write do not fit the format.
    #[error("the recording cannot be written")]
    Mcap(#[from] mcap::McapError),
    /// A frame cannot be read.
    #[error("frame {sequence} of the recording cannot be read: {reason}")]
    Frame {
        /// Its sequence number.
        sequence: u64,
        /// What is wrong.
        reason: String,
    },
    /// No frame can be exported.
    #[error("the recording has no frame with a stage position")]
    NothingToExport,
    /// The capture folder cannot be written.
    #[error("the capture folder cannot be written")]
    Capture(#[from] capture::CaptureError),
    /// An image cannot be written.
    #[error("an image of the capture cannot be written")]
    Image(#[from] capture::ImageFileError),
}

impl RecordingError {
    /// Whether the disk is full.
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
            Self::NotMcap { .. } => "use an .mcap file",
            Self::NotARecording { .. } => "use a file recorded by a station",
            Self::Frame { .. } => "repair the recording first: sheaf recording repair",
            Self::NothingToExport => "record a scan, or a live view with the stage homed",
            error if error.is_full_disk() => "free disk space",
            _ => return None,
        }))
    }
}
