//! Counts frame reads as the progress of the evaluation.

use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering};

use optics::StagePosition;
use scanning::{ContentError, Frames};
use vision::Centrelines;

/// Frames with a callback after every read.
pub struct CountedFrames<'a> {
    frames: &'a dyn Frames,
    read: AtomicUsize,
    on_read: &'a (dyn Fn(usize) + Sync),
}

impl<'a> CountedFrames<'a> {
    /// `on_read` gets the number of reads so far.
    pub fn new(frames: &'a dyn Frames, on_read: &'a (dyn Fn(usize) + Sync)) -> Self {
        Self { frames, read: AtomicUsize::new(0), on_read }
    }

    /// Number of reads so far.
    pub fn n_read(&self) -> usize {
        self.read.load(Ordering::Relaxed)
    }
}

impl Frames for CountedFrames<'_> {
    fn n_frames(&self) -> usize {
        self.frames.n_frames()
    }

    fn position(&self, frame: usize) -> StagePosition {
        self.frames.position(frame)
    }

    fn lit_line(&self, frame: usize) -> Option<i8> {
        self.frames.lit_line(frame)
    }

    fn centrelines(&self, frame: usize) -> Result<Cow<'_, Centrelines>, ContentError> {
        let lines = self.frames.centrelines(frame);
        (self.on_read)(self.read.fetch_add(1, Ordering::Relaxed) + 1);
        lines
    }
}
