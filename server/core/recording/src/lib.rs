//! Recordings `sheaf-recording/1`: what a station saw and did, as an MCAP file that Foxglove and rerun open.
//!
//! Frames are kept as the camera delivered them, bit by bit, with stage, device settings, events, peaks and profiles
//! beside them; what the file is and its calibration come first, so that a file that was broken off says what it is.
//! [`RecordingWriter`] writes, [`RecordingFile`] reads whatever is whole, [`repair`] makes a broken file a whole one, and
//! [`export`] makes a capture folder of it. Which frames are written and when they are synced is not known here.

mod error;
mod export;
mod file;
pub mod foxglove;
mod frames;
mod header;
mod messages;
pub mod params;
mod records;
mod repair;
mod summary;
mod topics;
mod writer;

pub use error::RecordingError;
pub use export::{Exported, export};
pub use file::{Damage, RecordedFrame, RecordingFile};
pub use header::{RecordingEnd, RecordingHeader};
pub use messages::{
    DeviceNote, EventNote, FrameLosses, FrameNote, JsonMessage, PeakLine, PeaksNote, Place, ProfilePoint, RowNote,
    SettingsNote, StageNote,
};
pub use repair::{Repaired, repair};
pub use summary::{Gap, RecordingSummary, TopicCount};
pub use topics::Topic;
pub use writer::RecordingWriter;
