//! Recordings `sheaf-recording/1`: what a station observed and did, as an MCAP file that Foxglove and rerun open.
//!
//! Frames are stored exactly as delivered by the camera, with stage, device settings, events, peaks and profiles;
//! header and calibration come first, so that an interrupted file can be identified. [`RecordingWriter`] writes,
//! [`RecordingFile`] reads the intact part, [`repair()`] completes an interrupted file, and [`export()`] converts it to a
//! capture folder. Which frames are written and when they are synced is decided by the caller.

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
    DeviceNote, EventNote, FrameLosses, FrameNote, JsonMessage, PeakLine, PeaksNote, ProfilePoint,
    RecordedPosition, RowNote, SettingsNote, StageNote,
};
pub use repair::{Repaired, repair};
pub use summary::{Gap, RecordingSummary, TopicCount};
pub use topics::Topic;
pub use writer::RecordingWriter;
