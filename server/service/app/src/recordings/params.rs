//! Times and sizes of recording, each with its reason.

use std::time::Duration;

/// Time between two closed chunks: what a process that dies leaves is at most this old. A second is promised.
pub const FLUSH_EVERY: Duration = Duration::from_millis(300);

/// Longest wait for a frame before notes and time are looked at.
pub const TURN: Duration = Duration::from_millis(50);

/// Notes that may wait beside the frames: rows of a second at 1,000 frames/s, and what happens meanwhile.
pub const NOTES: usize = 2048;

/// Room that is needed above the floor to begin: a few seconds of a large camera.
pub const BEGIN_BYTES: u64 = 64 << 20;

/// Profiles and peaks a second: they are computed for viewers, the pictures are all there.
pub const PROFILES_HZ: f64 = 10.0;

/// Longest wait for the end of a recording that was told to end: the queue is written, index and end follow.
pub const END_WAIT: Duration = Duration::from_secs(20);
