//! The memory of frames: a fixed number of buffers that come back when the last one who looks drops the frame.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use vision::{GreyImage, Pixels};

use crate::station::params::FRAME_BUFFERS;

/// Buffers that are free, the one used last on top, so that few are touched when few are needed.
pub struct Pool {
    free: Vec<GreyImage>,
    returned: Receiver<GreyImage>,
    home: SyncSender<GreyImage>,
}

impl Default for Pool {
    fn default() -> Self {
        let (home, returned) = sync_channel(FRAME_BUFFERS);
        Self { free: (0..FRAME_BUFFERS).map(|_| empty_image()).collect(), returned, home }
    }
}

impl Pool {
    /// A free buffer; `None` if all are in someone's hands.
    pub fn take(&mut self) -> Option<GreyImage> {
        self.free.extend(self.returned.try_iter());
        self.free.pop()
    }

    /// Where a frame's buffer goes at its end.
    pub fn home(&self) -> SyncSender<GreyImage> {
        self.home.clone()
    }
}

/// An image that holds no memory worth speaking of.
pub fn empty_image() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel is an image")
}
