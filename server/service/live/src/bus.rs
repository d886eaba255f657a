//! The live bus: producers publish, viewers subscribe.

use std::sync::Arc;

use bytes::Bytes;
use optics::{Calibration, StagePosition, Triangulator};
use scanning::Profile;
use station::SharedFrame;
use tokio::sync::watch;
use vision::Centrelines;

use crate::interest::{Demand, Demands, StreamKind};
use crate::points::{PointLog, PointsSeen};

/// A processed frame.
pub struct LiveFrame {
    /// The pixels and their time.
    pub frame: SharedFrame,
    /// The lines in it.
    pub centrelines: Centrelines,
    /// Labelled and triangulated; `None` without an active calibration.
    pub profile: Option<Profile>,
    /// The calibration of the profile.
    pub calibration_id: Option<Arc<str>>,
}

/// The live bus. Clones share it.
#[derive(Clone)]
pub struct LiveBus {
    frames: watch::Sender<Option<Arc<LiveFrame>>>,
    points: watch::Sender<PointsSeen>,
    calibration: watch::Sender<Option<Arc<Triangulator>>>,
    demands: watch::Sender<Demands>,
}

impl Default for LiveBus {
    fn default() -> Self {
        Self {
            frames: watch::Sender::new(None),
            points: watch::Sender::new(PointsSeen::default()),
            calibration: watch::Sender::new(None),
            demands: watch::Sender::new(Demands::default()),
        }
    }
}

impl LiveBus {
    /// Publishes a frame; the newest wins.
    pub fn show(&self, frame: Arc<LiveFrame>) {
        self.frames.send_replace(Some(frame));
    }

    /// Follows the frames.
    pub fn watch_frames(&self) -> watch::Receiver<Option<Arc<LiveFrame>>> {
        self.frames.subscribe()
    }

    /// Registers a demand of at most `rate_hz` per second, valid until the returned value is dropped.
    pub fn subscribe(&self, kind: StreamKind, rate_hz: f64) -> Demand {
        Demand::new(&self.demands, kind, rate_hz)
    }

    /// Follows the demands.
    pub fn watch_demands(&self) -> watch::Receiver<Demands> {
        self.demands.subscribe()
    }

    /// Which calibration live profiles are computed with.
    pub fn set_calibration(&self, calibration: Option<Arc<Triangulator>>) {
        self.calibration.send_replace(calibration);
    }

    /// Follows it.
    pub fn watch_calibration(&self) -> watch::Receiver<Option<Arc<Triangulator>>> {
        self.calibration.subscribe()
    }

    /// Starts the points of a scan; those of the previous scan are dropped.
    pub fn begin_scan(&self, scan_id: &str) {
        let log = Arc::new(PointLog::new(scan_id));
        self.points.send_replace(PointsSeen { log: Some(log), n_blocks: 0, running: true });
    }

    /// Publishes the points of a frame of the started scan, in the part frame; a frame without points has no block.
    pub fn add_profile_points(
        &self,
        scan_id: &str,
        frame_idx: u32,
        position: StagePosition,
        profile: &Profile,
        calibration: &Calibration,
    ) {
        let Some(log) = self.points.borrow().log_of(scan_id).cloned() else { return };
        // Packed before the lock is taken.
        let n_blocks = log.add(frame_idx, position, profile, calibration);
        self.points.send_if_modified(|seen| {
            if seen.log_of(scan_id).is_none() {
                return false;
            }
            let grown = n_blocks > seen.n_blocks;
            seen.n_blocks = n_blocks;
            grown
        });
    }

    /// Ends the points of a scan. Returns its blocks: concatenated they are the display artifact. Empty unless it is the
    /// scan that was started last.
    pub fn end_scan(&self, scan_id: &str) -> Vec<Bytes> {
        let mut blocks = Vec::new();
        self.points.send_if_modified(|seen| {
            let Some(log) = seen.log_of(scan_id) else { return false };
            blocks = log.blocks();
            std::mem::replace(&mut seen.running, false)
        });
        blocks
    }

    /// Whether a scan is shown.
    pub fn scan_runs(&self) -> bool {
        self.points.borrow().running
    }

    /// Follows the points of the scan that was started last.
    pub fn watch_points(&self) -> watch::Receiver<PointsSeen> {
        self.points.subscribe()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_another_scan_are_not_mixed_in() {
        let bus = LiveBus::default();
        bus.begin_scan("01890000-0000-7000-8000-000000000001");
        assert!(bus.points.borrow().running);
        assert_eq!(bus.end_scan("01890000-0000-7000-8000-000000000002"), Vec::<Bytes>::new());
        assert!(bus.points.borrow().running);
        bus.end_scan("01890000-0000-7000-8000-000000000001");
        assert!(!bus.points.borrow().running);
    }
}
