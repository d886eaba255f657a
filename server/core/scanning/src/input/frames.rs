//! The frames of a scan, from any storage, read one at a time and possibly several times.

use std::borrow::Cow;

use optics::StagePosition;
use remedy::{Remedy, with_causes};
use vision::Centrelines;

use crate::error::{ContentError, ScanError};
use crate::threads::map_with;

/// Frames processed together, while the results of the batch before are consumed in order: enough for many threads,
/// little memory.
const BATCH_FRAMES: usize = 32;

/// One frame of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanFrame {
    /// The lines found in its image.
    pub centrelines: Centrelines,
    /// Stage position.
    pub position: StagePosition,
}

/// The frames of a scan, in order of capture. In memory, or in a peaks file (`files::peaks::PeaksFile`), so that a
/// large scan need not fit into memory.
pub trait Frames: Sync {
    /// Number of frames.
    fn n_frames(&self) -> usize;
    /// Stage position of a frame.
    fn position(&self, frame: usize) -> StagePosition;
    /// The line that was switched on alone in a frame, see [`Centrelines::lit_line`].
    fn lit_line(&self, frame: usize) -> Option<i8>;
    /// The lines of a frame, identical on every call.
    ///
    /// # Errors
    /// [`ContentError`] if they can no longer be read.
    fn centrelines(&self, frame: usize) -> Result<Cow<'_, Centrelines>, ContentError>;
}

impl Frames for &[ScanFrame] {
    fn n_frames(&self) -> usize {
        self.len()
    }

    fn position(&self, frame: usize) -> StagePosition {
        self[frame].position
    }

    fn lit_line(&self, frame: usize) -> Option<i8> {
        self[frame].centrelines.lit_line
    }

    fn centrelines(&self, frame: usize) -> Result<Cow<'_, Centrelines>, ContentError> {
        Ok(Cow::Borrowed(&self[frame].centrelines))
    }
}

/// A single frame, without motion.
pub(crate) struct OneFrame<'a>(pub &'a Centrelines);

impl Frames for OneFrame<'_> {
    fn n_frames(&self) -> usize {
        1
    }

    fn position(&self, _: usize) -> StagePosition {
        StagePosition::LinearMm(0.0)
    }

    fn lit_line(&self, _: usize) -> Option<i8> {
        self.0.lit_line
    }

    fn centrelines(&self, _: usize) -> Result<Cow<'_, Centrelines>, ContentError> {
        Ok(Cow::Borrowed(self.0))
    }
}

/// The lines of a frame, or the error that ends the evaluation.
pub(crate) fn lines_of(frames: &dyn Frames, frame: usize) -> Result<Cow<'_, Centrelines>, ScanError> {
    frames.centrelines(frame).map_err(|error| ScanError::UnreadableFrame {
        frame,
        problem: with_causes(&error),
        remedy: error.remedy().map(Cow::into_owned),
    })
}

/// Runs `work` on the lines of every frame, on all threads; returns the results in order.
pub(crate) fn of_every_frame<T: Send>(
    frames: &dyn Frames,
    work: impl Fn(usize, &Centrelines) -> T + Sync,
) -> Result<Vec<T>, ScanError> {
    let of_frame = |(): &mut (), frame| Ok(work(frame, &*lines_of(frames, frame)?));
    map_with(frames.n_frames(), 1, || (), of_frame).into_iter().collect()
}

/// Runs `work` on the numbers below `n`, on all threads; `take` receives the results in order, in the calling thread,
/// while the next batch is worked on.
pub(crate) fn in_order<T: Send, E: Send>(
    n: usize,
    work: impl Fn(usize) -> Result<T, E> + Sync,
    mut take: impl FnMut(T) -> Result<(), E>,
) -> Result<(), E> {
    let batch =
        |first: usize| map_with(BATCH_FRAMES.min(n - first), 1, || (), |(): &mut (), idx| work(first + idx));
    let mut ready = batch(0);
    for first in (BATCH_FRAMES..n).step_by(BATCH_FRAMES) {
        let mut next = Vec::new();
        rayon::in_place_scope(|scope| {
            scope.spawn(|_| next = batch(first));
            ready.drain(..).try_for_each(|result| take(result?))
        })?;
        ready = next;
    }
    ready.into_iter().try_for_each(|result| take(result?))
}
