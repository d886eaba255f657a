//! Every frame of the camera, for a recording.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use crate::shared::frame::SharedFrame;
use crate::shared::status::{DropCounts, Lost};

/// Frames as they arrive, of a live view, of single exposures and of a job. The station does not wait: frames not taken
/// in time are counted as `recorder`.
pub struct FrameTap {
    /// The frames in order; disconnected when the tap was closed.
    pub frames: Receiver<TappedFrame>,
    /// Exposures missing from `frames`, by reason; final once `frames` is disconnected.
    pub dropped: Arc<DropCounts>,
}

/// A frame, and the losses before it.
pub struct TappedFrame {
    /// The frame.
    pub frame: SharedFrame,
    /// Exposures since the previous frame that did not arrive.
    pub lost: Lost,
    /// Frames since then that arrived and were not taken in time.
    pub untaken: u64,
}
