//! What is seen at this moment: frames with their centrelines and profiles, and the points of a running scan.
//!
//! Eyes may lose frames: a picture or profile that nobody took in time is replaced by the next one. The points of a
//! scan are a sequence without gaps, kept until the scan is stored.

use std::sync::Arc;

use optics::Calibration;
use scanning::Profile;
use tokio::sync::watch;
use vision::Centrelines;

use crate::station::SharedFrame;

/// One frame, seen through.
pub struct LiveFrame {
    /// The pixels and their moment.
    pub frame: SharedFrame,
    /// The lines in it.
    pub centrelines: Centrelines,
    /// Labelled and triangulated; `None` without an active calibration.
    pub profile: Option<Profile>,
    /// The calibration of the profile.
    pub calibration_id: Option<String>,
}

/// A block of points of a running scan, packed for display.
#[derive(Debug, Clone, PartialEq)]
pub struct PointBlock {
    /// Position in the scan's sequence, from 0, without gaps.
    pub block: u32,
    /// The bytes of the stream message (`openapi/stream.md`).
    pub bytes: bytes::Bytes,
}

/// The points of one running scan so far.
#[derive(Debug, Clone, Default)]
pub struct PointLog {
    /// The scan.
    pub scan_id: String,
    /// All blocks so far; shared, never changed.
    pub blocks: Arc<Vec<PointBlock>>,
}

/// Where producers put what viewers see.
#[derive(Clone)]
pub struct LiveBus {
    frames: watch::Sender<Option<Arc<LiveFrame>>>,
    points: watch::Sender<PointLog>,
    calibration: watch::Sender<Option<Arc<Calibration>>>,
}

impl Default for LiveBus {
    fn default() -> Self {
        Self {
            frames: watch::Sender::new(None),
            points: watch::Sender::new(PointLog::default()),
            calibration: watch::Sender::new(None),
        }
    }
}

impl LiveBus {
    /// Shows a frame; the newest wins.
    pub fn show(&self, frame: Arc<LiveFrame>) {
        self.frames.send_replace(Some(frame));
    }

    /// Follows the frames.
    pub fn watch_frames(&self) -> watch::Receiver<Option<Arc<LiveFrame>>> {
        self.frames.subscribe()
    }

    /// Which calibration live profiles are computed with.
    pub fn set_calibration(&self, calibration: Option<Arc<Calibration>>) {
        self.calibration.send_replace(calibration);
    }

    /// Follows it.
    pub fn watch_calibration(&self) -> watch::Receiver<Option<Arc<Calibration>>> {
        self.calibration.subscribe()
    }

    /// Follows the points of the running scan.
    pub fn watch_points(&self) -> watch::Receiver<PointLog> {
        self.points.subscribe()
    }
}
