//! Limits and paces of the drivers, each with its reason.

use std::time::Duration;

/// Slowest replay, Hz: one frame in ten seconds, for looking at single frames.
pub const REPLAY_MIN_RATE_HZ: f64 = 0.1;

/// Fastest timed replay, Hz; faster than any camera of this field, and twice what the service is to keep up with.
pub const REPLAY_MAX_RATE_HZ: f64 = 1000.0;

/// Speed told for a replayed stage, mm/s; what it accepts has no effect, its positions come from the recording.
pub const REPLAY_MAX_SPEED_MM_S: f64 = 1000.0;

/// Most memory that preloaded pictures may take, bytes: 1,600 frames of 1280×1024, half of a small computer.
pub const PRELOAD_LIMIT_BYTES: usize = 2 << 30;

/// How far a replayed frame may be late before the pace starts anew at the present; less is caught up.
pub const REPLAY_CATCH_UP: Duration = Duration::from_millis(100);
