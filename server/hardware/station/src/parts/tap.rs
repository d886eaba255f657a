//! The station's end of a [`FrameTap`]: offers every frame without waiting.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};

use crate::params::TAP_FRAMES;
use crate::shared::frame::SharedFrame;
use crate::shared::status::{DropCounts, Lost};
use crate::shared::tap::{FrameTap, TappedFrame};

/// Offers every frame to one recording.
pub struct Tap {
    frames: SyncSender<TappedFrame>,
    /// Exposures lost since the last frame taken.
    lost: Lost,
    /// Frames since then that arrived and were not taken in time.
    untaken: u64,
    dropped: Arc<DropCounts>,
}

impl Tap {
    /// A tap and its receiver.
    pub fn new() -> (Self, FrameTap) {
        let (frames, receiver) = sync_channel(TAP_FRAMES);
        let dropped = Arc::new(DropCounts::default());
        let tapped = FrameTap { frames: receiver, dropped: dropped.clone() };
        (Self { frames, lost: Lost::default(), untaken: 0, dropped }, tapped)
    }

    /// Offers a frame before which exposures were lost; frames not taken are added to `totals`. Returns `false` if the
    /// receiver was dropped.
    pub fn offer(&mut self, frame: &SharedFrame, lost: Lost, totals: &DropCounts) -> bool {
        lost.count_into(&self.dropped);
        self.lost.add(lost);
        let offered = TappedFrame { frame: frame.clone(), lost: self.lost, untaken: self.untaken };
        match self.frames.try_send(offered) {
            Ok(()) => (self.lost, self.untaken) = (Lost::default(), 0),
            Err(TrySendError::Full(_)) => {
                self.untaken += 1;
                self.dropped.recorder.fetch_add(1, Ordering::Relaxed);
                totals.recorder.fetch_add(1, Ordering::Relaxed);
            }
            Err(TrySendError::Disconnected(_)) => return false,
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use vision::{GreyImage, Pixels};

    use super::*;
    use crate::StampedFrame;

    fn frame(sequence: u64) -> SharedFrame {
        let image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        Arc::new(StampedFrame::detached(sequence, 0.0, image))
    }

    #[test]
    fn frames_not_taken_in_time_are_counted_and_reported_with_the_next_one() {
        let (mut tap, tapped) = Tap::new();
        let totals = DropCounts::default();
        let n_offered = TAP_FRAMES as u64 + 3;
        for sequence in 1..=n_offered {
            assert!(tap.offer(&frame(sequence), Lost { camera: 1, ..Lost::default() }, &totals));
        }
        let taken: Vec<TappedFrame> = tapped.frames.try_iter().collect();
        assert_eq!(taken.len(), TAP_FRAMES);
        assert!(taken.iter().all(|taken| taken.lost.camera == 1 && taken.untaken == 0));
        assert_eq!((tapped.dropped.recorder.load(Ordering::Relaxed), totals.total()), (3, 3));
        assert!(tap.offer(&frame(n_offered + 1), Lost::default(), &totals));
        let next = tapped.frames.try_recv().unwrap();
        assert_eq!((next.frame.sequence, next.lost.camera, next.untaken), (n_offered + 1, 3, 3));
        let exposed = 2 * n_offered + 1;
        assert_eq!(
            taken.len() as u64 + 1 + tapped.dropped.total(),
            exposed,
            "frames taken and dropped add up to those exposed"
        );
        drop(tapped);
        assert!(!tap.offer(&frame(n_offered + 2), Lost::default(), &totals));
    }
}
