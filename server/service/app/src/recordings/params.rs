//! Constants of recordings, each with its reason.

use std::time::Duration;

/// Interval of closing chunks: a crash loses at most this much. One second is promised.
pub const FLUSH_EVERY: Duration = Duration::from_millis(300);

/// Maximum wait for a frame before notes and time are checked.
pub const TURN: Duration = Duration::from_millis(50);

/// Capacity of the note queue: one second of rows at 1,000 frames/s, plus other notes.
pub const NOTES: usize = 2048;

/// Notes written between two frames: a frame has a row, a stage position and seldom a profile. More wait, so that notes
/// that arrive faster than they can be written never keep frames, or the end, waiting.
pub const NOTES_PER_TURN: usize = 8;

/// Free space needed above the limit to start: a few seconds of a large camera.
pub const BEGIN_BYTES: u64 = 64 << 20;

/// Maximum rate of profiles and peaks, per second: they are a preview, all frames are recorded.
pub const PROFILES_HZ: f64 = 10.0;

/// Maximum wait for the end of a recording after it was requested: queue, index and end are written.
pub const END_WAIT: Duration = Duration::from_secs(20);
