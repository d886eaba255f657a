//! The camera's dark frame, and for which of its frames it holds.

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
    /// The part of the sensor.
    pub roi: Roi,
    /// Gain.
    pub gain_db: f64,
    /// Exposure time.
    pub exposure_us: f64,
    /// Which way the laser lines run.
    pub line_direction: LineDirection,
}

/// What tells a camera from others.
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

/// How frames are corrected for what the sensor shows without light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DarkUse {
    /// Not: there is no dark frame.
    NoDarkFrame,
    /// Not: the dark frame is of another camera.
    OtherCamera,
    /// Not: the dark frame does not cover the region, or has another pixel format.
    OtherFormat,
    /// Hot pixels are replaced; the pattern is that of another gain and stays.
    HotPixels,
    /// The pattern is subtracted and hot pixels are replaced.
    Whole,
}

impl DarkUse {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoDarkFrame => "no_dark_frame",
            Self::OtherCamera => "other_camera",
            Self::OtherFormat => "other_format",
            Self::HotPixels => "hot_pixels",
            Self::Whole => "whole",
        }
    }
}

impl CameraDarkFrame {
    /// How it is used for frames of this camera at these settings.
    pub fn use_for(&self, camera: &DeviceIdentity, settings: &CameraSettings) -> DarkUse {
        let bits = if settings.pixel_format == PixelFormat::Mono8 { 8 } else { 16 };
        let (own, roi) = (self.roi, settings.roi);
        let covered = roi.left_px >= own.left_px
            && roi.top_px >= own.top_px
            && roi.left_px + roi.width_px <= own.left_px + own.width_px
            && roi.top_px + roi.height_px <= own.top_px + own.height_px;
        match () {
            () if !self.camera.is(camera) => DarkUse::OtherCamera,
            () if !covered || self.frame.figures().bit_depth != bits => DarkUse::OtherFormat,
            () if (self.gain_db - settings.gain_db).abs() > SAME_GAIN_DB => DarkUse::HotPixels,
            () => DarkUse::Whole,
        }
    }

    /// Corrects a frame of this camera at these settings as far as it holds for it.
    pub(crate) fn correct(&self, image: &mut GreyImage, camera: &DeviceIdentity, settings: &CameraSettings) {
        let wanted = match self.use_for(camera, settings) {
            DarkUse::Whole => Correction::Whole,
            DarkUse::HotPixels => Correction::HotPixels,
            DarkUse::NoDarkFrame | DarkUse::OtherCamera | DarkUse::OtherFormat => return,
        };
        let place = (settings.roi.left_px - self.roi.left_px, settings.roi.top_px - self.roi.top_px);
        // A frame of another size was refused before.
        let _ = self.frame.correct(image, place, self.line_direction, wanted);
    }
}
