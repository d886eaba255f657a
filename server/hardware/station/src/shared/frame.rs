//! Frames as stamped by the station thread.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use vision::GreyImage;

use crate::shared::dark_frame::AppliedDarkFrame;
use crate::shared::pool::empty_image;
use crate::shared::status::DropCounts;

/// A frame with the state of the station at its exposure.
pub struct StampedFrame {
    /// The station's own count of arrived frames, from 1, without gaps.
    pub sequence: u64,
    /// Middle of the exposure.
    pub captured_at: Instant,
    /// Time at which the driver delivered it.
    pub arrived_at: Instant,
    /// Middle of the exposure, nanoseconds since the station thread started.
    pub captured_at_ns: u64,
    /// Stage position at the middle of the exposure, interpolated between readings; `None` if unknown.
    pub position_mm: Option<f64>,
    /// Exposures lost between the previous frame and this one.
    pub lost_before: u64,
    /// Exposure time.
    pub exposure_us: f64,
    /// Whether the laser was on.
    pub laser_on: bool,
    /// The dark frame it was corrected with; `None` if it was not corrected.
    pub dark_frame: Option<AppliedDarkFrame>,
    /// Pixels; the station reuses their memory when the last owner drops the frame.
    pub image: GreyImage,
}

impl StampedFrame {
    /// Memory for a frame.
    pub(crate) fn empty() -> Self {
        let now = Instant::now();
        Self {
            sequence: 0,
            captured_at: now,
            arrived_at: now,
            captured_at_ns: 0,
            position_mm: None,
            lost_before: 0,
            exposure_us: 0.0,
            laser_on: false,
            dark_frame: None,
            image: empty_image(),
        }
    }
}

impl StampedFrame {
    /// A frame that does not come from a station, exposed now.
    pub fn detached(sequence: u64, position_mm: f64, image: GreyImage) -> Self {
        Self {
            sequence,
            captured_at: Instant::now(),
            arrived_at: Instant::now(),
            captured_at_ns: sequence * 1_000_000,
            position_mm: Some(position_mm),
            lost_before: 0,
            exposure_us: 2000.0,
            laser_on: true,
            dark_frame: None,
            image,
        }
    }
}

/// A frame with several owners.
pub type SharedFrame = Arc<StampedFrame>;

/// All frames of a run, in order; frames that could not be delivered are counted, never skipped silently.
pub struct FrameStream {
    /// The frames; disconnected when the run has ended or failed.
    pub frames: Receiver<SharedFrame>,
    /// Losses of this run, by reason; final once `frames` is disconnected.
    pub dropped: Arc<DropCounts>,
    /// Why the run ended early, once `frames` is disconnected.
    pub(crate) ended: Receiver<crate::StationRefusal>,
}

impl FrameStream {
    /// Why the run ended early; `None` if it was completed.
    pub fn end_reason(&self) -> Option<crate::StationRefusal> {
        self.ended.try_recv().ok()
    }
}
