//! Frame memory: a fixed number of buffers, reused when the last owner drops the frame.

use vision::{GreyImage, Pixels};

use crate::params::FRAME_BUFFERS;
use crate::shared::frame::StampedFrame;
use crate::shared::recycling::Recycling;

/// All buffers of a camera.
pub type Pool = Recycling<StampedFrame>;

/// A pool of the largest permitted size.
pub fn pool() -> Pool {
    Pool::of(FRAME_BUFFERS, StampedFrame::empty)
}

/// An image that occupies almost no memory.
pub fn empty_image() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel is an image")
}
