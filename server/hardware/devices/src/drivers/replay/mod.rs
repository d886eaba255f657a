//! Replay: camera, stage and laser of a capture folder, or of a recording in an MCAP file.
//!
//! Free-running, the camera delivers the images of one scan (or the board or laser images) in their order, and the
//! stage is at the position of the last delivered frame: a move ends when frames pass its target. A move that starts
//! before the first frame begins with the image taken at the stage's position and plays towards its target, forwards
//! or backwards: that is a sweep. Otherwise moves take no time, and a software trigger delivers the image taken at
//! the stage's position, so that a row-by-row scan gets the recorded rows. The stage moves to recorded positions only.
//! The laser only implements the rules of leases.

mod camera;
mod driver;
mod file;
mod folder;
mod laser;
mod playback;
mod sequence;
mod stage;
#[cfg(test)]
mod tests;

pub use camera::ReplayCamera;
pub use driver::{ReplayDriver, ReplaySettings};
pub use laser::ReplayLaser;
pub use stage::ReplayStage;

use parking_lot::Mutex;
use std::path::PathBuf;
use std::sync::Arc;

use capture::CaptureError;
use recording::RecordingError;

use crate::ValueRange;
use crate::params::{PRELOAD_LIMIT_BYTES, REPLAY_MAX_RATE_HZ, REPLAY_MIN_RATE_HZ};
use playback::Playback;
use sequence::Recording;

/// Configuration of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayConfig {
    /// Source.
    pub played: ReplaySource,
    /// Pace.
    pub pace: Pace,
    /// Whether it restarts after the last image.
    pub repeat: bool,
    /// Whether all images are read into memory when it is opened.
    pub preload: bool,
}

/// Source of the images.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ReplaySource {
    /// From a capture folder.
    Folder {
        /// Path of the folder.
        folder: PathBuf,
        /// Which of its images.
        images: ImageSelection,
    },
    /// From an MCAP file: the frames of its scan, or all.
    Recording(PathBuf),
}

/// Which images of a capture are replayed.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ImageSelection {
    /// The frames of the scan of this name.
    Scan(String),
    /// The board of every pose in normal light.
    Boards,
    /// The board of every pose in laser light.
    LaserImages,
    /// The board on the stage.
    StageViews,
}

/// Pace of delivery.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// Frames per second.
    Hz(f64),
    /// Without delay.
    Unlimited,
}

/// Why a capture cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The folder or one of its images cannot be read.
    #[error("the capture cannot be replayed")]
    Capture(#[from] CaptureError),
    /// The file or one of its frames cannot be read.
    #[error("the recording cannot be replayed")]
    Recording(#[from] RecordingError),
    /// A camera has one image size and format, but those of the recording differ.
    #[error("frame {frame_idx} of {} has another size or format than the first", path.display())]
    OtherSize {
        /// The recording.
        path: PathBuf,
        /// The first such frame, counted from 0.
        frame_idx: usize,
    },
    /// No images.
    #[error("{} contains no {images}", path.display())]
    NoImages {
        /// The capture or recording.
        path: PathBuf,
        /// The requested images.
        images: &'static str,
    },
    /// An unsupported pace.
    #[error("a replay cannot run at {hz} Hz, only at {REPLAY_MIN_RATE_HZ} to {REPLAY_MAX_RATE_HZ} Hz")]
    BadPace {
        /// The requested rate.
        hz: f64,
    },
    /// More images than may be preloaded.
    #[error(
        "the images need {size_bytes} bytes of memory, more than the {PRELOAD_LIMIT_BYTES} that may be preloaded"
    )]
    TooLargeToPreload {
        /// Their size.
        size_bytes: usize,
    },
}

impl ReplayError {
    /// The underlying cause, without the mention of a replay.
    fn into_cause(self) -> Box<dyn std::error::Error + Send + Sync> {
        match self {
            Self::Capture(cause) => Box::new(cause),
            Self::Recording(cause) => Box::new(cause),
            other => Box::new(other),
        }
    }
}

/// Supported frame rates of a replay.
pub(crate) const RATES_HZ: ValueRange = ValueRange { min: REPLAY_MIN_RATE_HZ, max: REPLAY_MAX_RATE_HZ };

/// Opens a capture or a recording as a station; the first image is read for its format.
///
/// # Errors
/// [`ReplayError`] names the entry that cannot be read.
pub fn open(config: &ReplayConfig) -> Result<(ReplayCamera, ReplayStage, ReplayLaser), ReplayError> {
    if let Pace::Hz(hz) = config.pace
        && !(REPLAY_MIN_RATE_HZ..=REPLAY_MAX_RATE_HZ).contains(&hz)
    {
        return Err(ReplayError::BadPace { hz });
    }
    let recording = Recording::open(config)?;
    let playback = Arc::new(Mutex::new(Playback::new(recording.first_position_mm())));
    let stage = ReplayStage::new(&recording, Arc::clone(&playback));
    let laser = ReplayLaser::new(recording.name());
    Ok((ReplayCamera::new(recording, config, playback), stage, laser))
}
