//! Frame numbers, exposure times and losses of one acquisition.

use std::time::{Duration, Instant};

use devices::{CameraError, CameraSettings, FrameInfo};
use vision::GreyImage;

use crate::device::{Filled, Format, Stamped};
use crate::pixels::{InvalidImage, SourceFormat};
use crate::settings::CameraChannel;

/// Frame counts since the acquisition started, and the state for the next frame.
pub struct Acquisition {
    format: Format,
    source: SourceFormat,
    channel: CameraChannel,
    settings: CameraSettings,
    /// The driver's number of the last frame received, including damaged ones, and its position in the count.
    last: Option<(u32, u64)>,
    /// The position after the last delivered frame.
    next: u64,
    /// Damaged frames since then.
    damaged: u64,
    last_exposed_at: Option<Instant>,
}

impl Acquisition {
    /// Starts an acquisition.
    pub fn new(format: Format, source: SourceFormat, channel: CameraChannel, settings: CameraSettings) -> Self {
        Self { format, source, channel, settings, last: None, next: 0, damaged: 0, last_exposed_at: None }
    }

    /// Damaged frames since the last delivered one.
    pub fn n_damaged(&self) -> u64 {
        self.damaged
    }

    /// Updates the settings that may change while it runs: the exposure.
    pub fn set(&mut self, settings: CameraSettings) {
        self.settings = settings;
    }

    /// Writes the frame into `image` and counts it; `None` for one that is damaged, or not newer than the last.
    ///
    /// # Errors
    /// [`CameraError::WrongFrame`] for an image of another size than configured.
    pub fn take(
        &mut self,
        filled: &Filled,
        received_at: Instant,
        image: &mut GreyImage,
    ) -> Result<Option<FrameInfo>, CameraError> {
        let Some(place) = self.count(filled.sequence) else { return Ok(None) };
        let unpacked = match filled.is_damaged {
            true => Err(InvalidImage::Incomplete),
            false => self.source.unpack(filled.bytes, &self.format, self.channel, image),
        };
        match unpacked {
            Ok(()) => {}
            Err(InvalidImage::Incomplete) => {
                self.damaged += 1;
                return Ok(None);
            }
            Err(InvalidImage::WrongSize(got_width_px, got_height_px)) => {
                return Err(CameraError::WrongFrame {
                    width_px: self.format.width_px,
                    height_px: self.format.height_px,
                    got_width_px,
                    got_height_px,
                });
            }
        }
        let lost_before = place - self.next;
        self.next = place + 1;
        Ok(Some(FrameInfo {
            frame_id: place,
            // The time stamps are this computer's: the kernel has already mapped the camera's clock.
            device_timestamp_ns: None,
            exposed_at: self.exposed_at(filled, received_at),
            lost_before,
            lost_incomplete: std::mem::take(&mut self.damaged).min(lost_before),
            exposure_us: self.settings.exposure_us,
            recorded_position_mm: None,
        }))
    }

    /// The frame's position in a count that starts with the first frame received; drivers use different first numbers.
    fn count(&mut self, sequence: u32) -> Option<u64> {
        let place = match self.last {
            None => 0,
            Some((last, place)) => {
                let steps = sequence.wrapping_sub(last);
                // A step of more than half the range is backwards: the frame is a duplicate, or out of order.
                if steps == 0 || steps > u32::MAX / 2 {
                    return None;
                }
                place + u64::from(steps)
            }
        };
        self.last = Some((sequence, place));
        Some(place)
    }

    /// The middle of the exposure.
    fn exposed_at(&mut self, filled: &Filled, received_at: Instant) -> Instant {
        let half = Duration::from_secs_f64((self.settings.exposure_us * 0.5e-6).clamp(0.0, 30.0));
        let before = |at: Instant| at.checked_sub(half).unwrap_or(at);
        let middle = match (filled.stamped_at, filled.stamped) {
            (Some(at), Stamped::ExposureStart) => at + half,
            (Some(at), Stamped::FrameEnd) => before(at),
            (None, _) => before(received_at),
        };
        // No frame is exposed after its arrival, nor before the previous one.
        let middle = middle.min(received_at).max(self.last_exposed_at.unwrap_or(middle));
        self.last_exposed_at = Some(middle);
        middle
    }
}
