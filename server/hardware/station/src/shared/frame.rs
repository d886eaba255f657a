//! Frames as the station thread stamps them.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Instant;

use vision::GreyImage;

use crate::shared::pool::empty_image;
use crate::shared::status::DropCounts;

/// A frame with the state of the station at its exposure.
pub struct StampedFrame {
    /// The station's own count of frames that arrived, from 1, without gaps.
    pub sequence: u64,
    /// The middle of the exposure.
    pub captured_at: Instant,
    /// When the driver had delivered it.
    pub arrived_at: Instant,
    /// The middle of the exposure, nanoseconds since the station thread began.
    pub captured_at_ns: u64,
    /// Stage position at the middle of the exposure, interpolated between readings; `None` is unknown.
    pub position_mm: Option<f64>,
    /// Exposures lost between the frame before and this one.
    pub lost_before: u64,
    /// How long the sensor collected light.
    pub exposure_us: f64,
    /// Whether the laser shone.
    pub laser_on: bool,
    /// The pixels; the station reuses their memory when nobody holds the frame any more.
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
            image: empty_image(),
        }
    }
}

impl StampedFrame {
    /// A frame that came from no station, exposed now.
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
            image,
        }
    }
}

/// A frame with several holders.
pub type SharedFrame = Arc<StampedFrame>;

/// Every frame of a run, in order; what could not be delivered is counted, never skipped silently.
pub struct FrameStream {
    /// The frames; disconnected when the run is over or broken.
    pub frames: Receiver<SharedFrame>,
    /// What was lost in this run, by reason; final once `frames` is disconnected.
    pub dropped: Arc<DropCounts>,
    /// Why the run ended before its end, once `frames` is disconnected.
    pub(crate) ended: Receiver<crate::StationRefusal>,
}

impl FrameStream {
    /// Why the run broke off; `None` if it came to its end.
    pub fn broken(&self) -> Option<crate::StationRefusal> {
        self.ended.try_recv().ok()
    }
}
