//! The memory of frames: a fixed number of buffers, reused when the last holder has dropped the frame.

use vision::{GreyImage, Pixels};

use crate::params::FRAME_BUFFERS;
use crate::shared::frame::StampedFrame;
use crate::shared::recycling::Recycling;

/// All buffers of a camera.
pub type Pool = Recycling<StampedFrame>;

/// As many as there may be.
pub fn pool() -> Pool {
    Pool::of(FRAME_BUFFERS, StampedFrame::empty)
}

/// An image that holds no memory worth speaking of.
pub fn empty_image() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel is an image")
}
