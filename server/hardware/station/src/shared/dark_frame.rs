//! The camera's dark frame, and the frames to which it applies.

use std::sync::Arc;

use devices::{CameraSettings, DeviceIdentity, PixelFormat, Roi};
use vision::{Correction, DarkFrame, GreyImage, LineDirection};

/// Gains that differ by less are the same, dB: cameras round them.
const SAME_GAIN_DB: f64 = 0.1;

/// A dark frame with the camera and the settings it was taken with.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraDarkFrame {
    /// Pattern and hot pixels.
    pub frame: DarkFrame,
    /// The camera.
    pub camera: CameraName,
    /// The region of the sensor.
    pub roi: Roi,
    /// Gain.
    pub gain_db: f64,
    /// Exposure time.
    pub exposure_us: f64,
    /// Direction of the laser lines.
    pub line_direction: LineDirection,
    /// When it was taken, ms since 1970 (UTC).
    pub taken_at_ms: i64,
}

/// The dark frame that a frame was corrected with.
#[derive(Debug, Clone)]
pub struct AppliedDarkFrame {
    /// The dark frame.
    pub dark: Arc<CameraDarkFrame>,
    /// What was corrected: [`DarkFrameUse::HotPixels`] or [`DarkFrameUse::Full`].
    pub used: DarkFrameUse,
}

/// Identifies a camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraName {
    /// Its driver.
    pub driver: String,
    /// Model.
    pub model: String,
    /// Serial number; empty if unknown.
    pub serial: String,
}

impl CameraName {
    /// Of a camera.
    pub fn of(camera: &DeviceIdentity) -> Self {
        Self { driver: camera.driver.to_owned(), model: camera.model.clone(), serial: camera.serial.clone() }
    }

    fn is(&self, camera: &DeviceIdentity) -> bool {
        self.driver == camera.driver && self.model == camera.model && self.serial == camera.serial
    }
}

/// How frames are corrected for the dark signal of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DarkFrameUse {
    /// Not corrected: there is no dark frame.
    NoDarkFrame,
    /// Not corrected: the dark frame is of another camera.
    OtherCamera,
    /// Not corrected: the dark frame does not cover the region, or has another pixel format.
    OtherFormat,
    /// Hot pixels are replaced; the pattern was taken at another gain and is not subtracted.
    HotPixels,
    /// The pattern is subtracted and hot pixels are replaced.
    Full,
}

impl DarkFrameUse {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoDarkFrame => "no_dark_frame",
            Self::OtherCamera => "other_camera",
            Self::OtherFormat => "other_format",
            Self::HotPixels => "hot_pixels",
            Self::Full => "full",
        }
    }
}

impl CameraDarkFrame {
    /// How it is used for frames of this camera at these settings.
    pub fn use_for(&self, camera: &DeviceIdentity, settings: &CameraSettings) -> DarkFrameUse {
        let bits = if settings.pixel_format == PixelFormat::Mono8 { 8 } else { 16 };
        let (own, roi) = (self.roi, settings.roi);
        let covered = roi.left_px >= own.left_px
            && roi.top_px >= own.top_px
            && roi.left_px + roi.width_px <= own.left_px + own.width_px
            && roi.top_px + roi.height_px <= own.top_px + own.height_px;
        match () {
            () if !self.camera.is(camera) => DarkFrameUse::OtherCamera,
            () if !covered || self.frame.statistics().bit_depth != bits => DarkFrameUse::OtherFormat,
            () if (self.gain_db - settings.gain_db).abs() > SAME_GAIN_DB => DarkFrameUse::HotPixels,
            () => DarkFrameUse::Full,
        }
    }

    /// Corrects a frame of this camera at these settings as far as it applies; `None` if it does not.
    pub(crate) fn correct(
        self: &Arc<Self>,
        image: &mut GreyImage,
        camera: &DeviceIdentity,
        settings: &CameraSettings,
    ) -> Option<AppliedDarkFrame> {
        let used = self.use_for(camera, settings);
        let wanted = match used {
            DarkFrameUse::Full => Correction::Full,
            DarkFrameUse::HotPixels => Correction::HotPixels,
            DarkFrameUse::NoDarkFrame | DarkFrameUse::OtherCamera | DarkFrameUse::OtherFormat => return None,
        };
        let offset_px = (settings.roi.left_px - self.roi.left_px, settings.roi.top_px - self.roi.top_px);
        // A frame of another size has been refused already.
        self.frame.correct(image, offset_px, self.line_direction, wanted)?;
        Some(AppliedDarkFrame { dark: Arc::clone(self), used })
    }
}
