//! Every frame of the camera, whoever made it expose, for somebody who keeps them.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use crate::shared::frame::SharedFrame;
use crate::shared::status::{DropCounts, Lost};

/// Frames as they arrive, of a live view, of single exposures, and of a job. The station waits for nobody: what is not
/// taken in time is counted as `recorder`.
pub struct FrameTap {
    /// The frames in their order; disconnected when the tap was closed.
    pub frames: Receiver<TappedFrame>,
    /// What was exposed and is not among them, by reason; final once `frames` is disconnected.
    pub dropped: Arc<DropCounts>,
}

/// A frame, and what is missing before it.
pub struct TappedFrame {
    /// The frame.
    pub frame: SharedFrame,
    /// Exposures since the frame before that did not arrive.
    pub lost: Lost,
    /// Frames since then that arrived and were not taken in time.
    pub untaken: u64,
}
