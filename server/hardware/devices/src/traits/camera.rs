//! A camera: settings, acquisition, frames in reused buffers.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use remedy::Remedy;
use vision::GreyImage;

use crate::DeviceIdentity;
use crate::traits::features::CameraDetails;

/// Pixel format of the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PixelFormat {
    /// 8 bits per pixel.
    Mono8,
    /// 16 bits per pixel; sensors of 10 or 12 bits are shifted to the top.
    Mono16,
}

/// Trigger mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Trigger {
    /// Free-running, at `frame_rate_hz`.
    Free,
    /// On [`Camera::trigger`].
    Software,
    /// By its electrical input: an encoder or a light barrier.
    Hardware,
}

/// A region of interest of the sensor, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Roi {
    /// First column.
    pub left_px: usize,
    /// First row.
    pub top_px: usize,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
}

/// Range of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

impl ValueRange {
    /// The nearest value within the range.
    pub fn clamp(&self, value: f64) -> f64 {
        value.clamp(self.min, self.max)
    }
}

/// Capabilities of the camera; `None` for a setting that it does not have.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraCapabilities {
    /// Whole sensor: columns and rows.
    pub sensor_px: (usize, usize),
    /// Exposure times, µs.
    pub exposure_us: Option<ValueRange>,
    /// Gain, dB.
    pub gain_db: Option<ValueRange>,
    /// Frame rates of [`Trigger::Free`], Hz.
    pub frame_rate_hz: Option<ValueRange>,
    /// Supported trigger modes.
    pub triggers: Vec<Trigger>,
    /// Pixel formats.
    pub pixel_formats: Vec<PixelFormat>,
    /// Whether a region of the sensor can be read.
    pub roi: bool,
}

impl CameraCapabilities {
    /// Settings to be expected of such a camera after `wanted`: numbers are clamped to their range.
    ///
    /// # Errors
    /// [`CameraError::Unsupported`] for a setting it does not have, or a value that is not a number.
    pub fn expected(&self, now: &CameraSettings, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        let refused = |setting, value: String| {
            let expected = "one of the values in its capabilities".to_owned();
            CameraError::Unsupported { setting, value, expected }
        };
        let number = |setting, wanted: Option<f64>, range: Option<ValueRange>, now| match (wanted, range) {
            (None, _) => Ok(now),
            (Some(wanted), Some(range)) if wanted.is_finite() => Ok(range.clamp(wanted)),
            (Some(wanted), _) => Err(refused(setting, wanted.to_string())),
        };
        let whole = Roi { left_px: 0, top_px: 0, width_px: self.sensor_px.0, height_px: self.sensor_px.1 };
        if let Some(trigger) = wanted.trigger.filter(|trigger| !self.triggers.contains(trigger)) {
            return Err(refused("trigger", format!("{trigger:?}")));
        }
        if let Some(format) = wanted.pixel_format.filter(|format| !self.pixel_formats.contains(format)) {
            return Err(refused("pixel_format", format!("{format:?}")));
        }
        if let Some(roi) = wanted.roi.filter(|roi| !self.roi && *roi != whole) {
            return Err(refused("roi", format!("{roi:?}")));
        }
        Ok(CameraSettings {
            exposure_us: number("exposure_us", wanted.exposure_us, self.exposure_us, now.exposure_us)?,
            gain_db: number("gain_db", wanted.gain_db, self.gain_db, now.gain_db)?,
            frame_rate_hz: number("frame_rate_hz", wanted.frame_rate_hz, self.frame_rate_hz, now.frame_rate_hz)?,
            trigger: wanted.trigger.unwrap_or(now.trigger),
            pixel_format: wanted.pixel_format.unwrap_or(now.pixel_format),
            roi: wanted.roi.unwrap_or(now.roi),
        })
    }
}

/// Requested settings; `None` leaves a setting unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraRequest {
    /// Exposure time.
    pub exposure_us: Option<f64>,
    /// Gain.
    pub gain_db: Option<f64>,
    /// Frame rate of [`Trigger::Free`].
    pub frame_rate_hz: Option<f64>,
    /// Trigger mode.
    pub trigger: Option<Trigger>,
    /// Pixel format.
    pub pixel_format: Option<PixelFormat>,
    /// Region of interest.
    pub roi: Option<Roi>,
}

/// Current settings: as accepted by the camera, not as requested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraSettings {
    /// Exposure time.
    pub exposure_us: f64,
    /// Gain.
    pub gain_db: f64,
    /// Frame rate of [`Trigger::Free`].
    pub frame_rate_hz: f64,
    /// Trigger mode.
    pub trigger: Trigger,
    /// Pixel format.
    pub pixel_format: PixelFormat,
    /// Region of interest.
    pub roi: Roi,
}

/// Data about a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameInfo {
    /// The camera's own count of exposures since acquisition started, from 0; gaps are lost frames.
    pub frame_id: u64,
    /// The camera's own clock at the middle of the exposure; `None` if it has none.
    pub device_timestamp_ns: Option<u64>,
    /// The middle of the exposure by this computer's monotonic clock, as accurately as the driver knows it.
    pub exposed_at: Instant,
    /// Exposures since the previous frame that did not arrive: lost on the cable, or by a buffer overrun in the driver.
    pub lost_before: u64,
    /// Those of them that arrived incomplete: packets were missing.
    pub lost_incomplete: u64,
    /// Exposure time; 0 if a recording does not state it.
    pub exposure_us: f64,
    /// Stage position of the recording, mm, if the frames come from one ([`crate::replay`]).
    pub recorded_position_mm: Option<f64>,
}

/// Why a camera refused or failed.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// It does not respond; it must be reopened.
    #[error("the camera is disconnected: {reason}")]
    Disconnected {
        /// What was detected.
        reason: String,
    },
    /// A frame had an unexpected size or format.
    #[error("the camera sent {got_width_px}×{got_height_px} pixels instead of {width_px}×{height_px}")]
    WrongFrame {
        /// Columns expected.
        width_px: usize,
        /// Rows expected.
        height_px: usize,
        /// Columns received.
        got_width_px: usize,
        /// Rows received.
        got_height_px: usize,
    },
    /// A setting it does not have, or an invalid value.
    #[error("the camera cannot take {setting} = {value}: {expected}")]
    Unsupported {
        /// The setting.
        setting: &'static str,
        /// The requested value.
        value: String,
        /// What is supported.
        expected: String,
    },
    /// A software trigger without acquisition, or in another trigger mode.
    #[error("the camera cannot be triggered now: {reason}")]
    NotTriggerable {
        /// Why.
        reason: &'static str,
    },
    /// The recording ended.
    #[error("the recording has no more frames")]
    EndOfRecording,
    /// An image of a recording cannot be read.
    #[error("frame {frame_id} of the recording cannot be read")]
    Unreadable {
        /// The frame.
        frame_id: u64,
        /// Why.
        #[source]
        cause: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl Remedy for CameraError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::Disconnected { .. } => "check cable and power, then reconnect",
            Self::WrongFrame { .. } => "set the region of interest again",
            Self::EndOfRecording => "start the replay again",
            Self::Unsupported { .. } | Self::NotTriggerable { .. } | Self::Unreadable { .. } => return None,
        }))
    }
}

/// A camera.
pub trait Camera: Send {
    /// Which camera this is.
    fn identity(&self) -> DeviceIdentity;

    /// Its capabilities.
    fn capabilities(&self) -> CameraCapabilities;

    /// Its current settings.
    fn settings(&self) -> CameraSettings;

    /// Applies the settings in `wanted` and returns all settings as accepted by the camera: numbers are moved to the
    /// nearest possible value.
    ///
    /// # Errors
    /// [`CameraError::Unsupported`] for a setting the camera does not have; then nothing has changed.
    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError>;

    /// Starts acquisition; frames of an earlier one are discarded. Starting again has no effect.
    fn start(&mut self) -> Result<(), CameraError>;

    /// Exposes one frame now; only with [`Trigger::Software`] and a started acquisition.
    fn trigger(&mut self) -> Result<(), CameraError>;

    /// Waits at most `timeout` for the next frame and writes it into `image`, whose memory is reused.
    ///
    /// `Ok(None)`: no frame in that time, as always without acquisition. Frames are returned in the order of their
    /// exposure, each once.
    ///
    /// # Errors
    /// [`CameraError::Disconnected`] if the camera does not respond: detected within two seconds, and returned by every later
    /// call.
    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError>;

    /// Its own features and the state of its link, for engineers; `None` if it has only the settings. The owner of the
    /// camera does not use it for setting.
    fn details(&self) -> Option<Arc<dyn CameraDetails>> {
        None
    }

    /// Number of frames that arrived incomplete since the last one delivered: a camera that sends them is not silent.
    fn n_incomplete(&self) -> u64 {
        0
    }

    /// Whether a frame that was exposed is still being computed, so that it is late without being lost. Only a
    /// simulated camera computes its frames; a hung one does not.
    fn is_computing(&self) -> bool {
        false
    }

    /// Ends acquisition. Works in every state.
    fn stop(&mut self) -> Result<(), CameraError>;

    /// Starts to reconnect the camera after [`CameraError::Disconnected`] and returns at once; other calls return
    /// `Disconnected` until it is connected. It is stopped afterwards, with its settings.
    fn reconnect(&mut self) -> Result<(), CameraError>;
}
