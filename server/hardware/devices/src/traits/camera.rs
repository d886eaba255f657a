//! A camera: settings, acquisition, frames into recycled buffers.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use remedy::Remedy;
use vision::GreyImage;

use crate::DeviceIdentity;
use crate::traits::features::CameraDetails;

/// How pixels leave the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PixelFormat {
    /// 8 bits per pixel.
    Mono8,
    /// 16 bits per pixel; sensors of 10 or 12 bits are shifted to the top.
    Mono16,
}

/// When the camera exposes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Trigger {
    /// By itself, at `frame_rate_hz`.
    Free,
    /// On [`Camera::trigger`].
    Software,
    /// On its electrical input: an encoder or a light barrier.
    Hardware,
}

/// A part of the sensor, pixels.
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

/// What a number may be set to.
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

/// What the camera can do; `None` is a setting that it does not have.
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
    /// Ways to trigger.
    pub triggers: Vec<Trigger>,
    /// Pixel formats.
    pub pixel_formats: Vec<PixelFormat>,
    /// Whether a part of the sensor can be read alone.
    pub roi: bool,
}

impl CameraCapabilities {
    /// Settings that a camera like this may be expected to have after `wanted`: numbers moved into their range.
    ///
    /// # Errors
    /// [`CameraError::Unsupported`] for a setting it does not have, and for a number that is none.
    pub fn expected(&self, now: &CameraSettings, wanted: &CameraRequest) -> Result<CameraSettings, CameraError> {
        let refused = |setting, value: String| {
            let expected = "what its capabilities name".to_owned();
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

/// What is wanted of a camera; `None` leaves a setting as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraRequest {
    /// Exposure time.
    pub exposure_us: Option<f64>,
    /// Gain.
    pub gain_db: Option<f64>,
    /// Frame rate of [`Trigger::Free`].
    pub frame_rate_hz: Option<f64>,
    /// When to expose.
    pub trigger: Option<Trigger>,
    /// How pixels come.
    pub pixel_format: Option<PixelFormat>,
    /// Which part of the sensor to read.
    pub roi: Option<Roi>,
}

/// How the camera is set: what it accepted, not what was wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraSettings {
    /// Exposure time.
    pub exposure_us: f64,
    /// Gain.
    pub gain_db: f64,
    /// Frame rate of [`Trigger::Free`].
    pub frame_rate_hz: f64,
    /// When it exposes.
    pub trigger: Trigger,
    /// How pixels come.
    pub pixel_format: PixelFormat,
    /// Which part of the sensor is read.
    pub roi: Roi,
}

/// What came with a frame's pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameInfo {
    /// The camera's own count of exposures since acquisition started, from 0; gaps are lost frames.
    pub frame_id: u64,
    /// The camera's own clock at the middle of the exposure; `None` if it has none.
    pub device_timestamp_ns: Option<u64>,
    /// The middle of the exposure by this computer's monotonic clock, as well as the driver can tell.
    pub exposed_at: Instant,
    /// Exposures since the frame before that never arrived: lost on the cable, or overrun in the driver.
    pub lost_before: u64,
    /// Those of them that arrived in part: packets were missing.
    pub lost_incomplete: u64,
    /// How long the sensor collected light; 0 if a recording does not tell.
    pub exposure_us: f64,
    /// Stage position of the recording, mm, if the frames come from one ([`crate::replay`]).
    pub recorded_position_mm: Option<f64>,
}

/// Why a camera did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// It does not answer any more; it must be opened again.
    #[error("the camera is gone: {reason}")]
    Gone {
        /// What was noticed.
        reason: String,
    },
    /// A frame was not of the size or format agreed.
    #[error("the camera sent {got_width_px}×{got_height_px} pixels instead of {width_px}×{height_px}")]
    WrongFrame {
        /// Columns agreed.
        width_px: usize,
        /// Rows agreed.
        height_px: usize,
        /// Columns received.
        got_width_px: usize,
        /// Rows received.
        got_height_px: usize,
    },
    /// A setting it does not have, or a value that makes no sense.
    #[error("the camera cannot take {setting} = {value}: {expected}")]
    Unsupported {
        /// Which setting.
        setting: &'static str,
        /// The value wanted.
        value: String,
        /// What it can do.
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
    /// A picture of a recording cannot be read.
    #[error("frame {frame_id} of the recording cannot be read")]
    Unreadable {
        /// Which frame.
        frame_id: u64,
        /// Why.
        #[source]
        cause: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl Remedy for CameraError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(Cow::Borrowed(match self {
            Self::Gone { .. } => "check cable and power, then reconnect",
            Self::WrongFrame { .. } => "set the region of interest again",
            Self::EndOfRecording => "start it again",
            Self::Unsupported { .. } | Self::NotTriggerable { .. } | Self::Unreadable { .. } => return None,
        }))
    }
}

/// A camera.
pub trait Camera: Send {
    /// Which camera this is.
    fn identity(&self) -> DeviceIdentity;

    /// What it can do.
    fn capabilities(&self) -> CameraCapabilities;

    /// How it is set.
    fn settings(&self) -> CameraSettings;

    /// Sets what `wanted` names and returns all settings as the camera accepted them: numbers are moved to the
    /// nearest possible value.
    ///
    /// # Errors
    /// [`CameraError::Unsupported`] for a setting the camera does not have; then nothing has changed.
    fn configure(&mut self, wanted: &CameraRequest) -> Result<CameraSettings, CameraError>;

    /// Starts acquisition; frames of an earlier one are gone. Starting twice is starting once.
    fn start(&mut self) -> Result<(), CameraError>;

    /// Exposes one frame now; only with [`Trigger::Software`] and a started acquisition.
    fn trigger(&mut self) -> Result<(), CameraError>;

    /// Waits at most `timeout` for the next frame and writes it into `image`, whose memory is used again.
    ///
    /// `Ok(None)`: nothing came in that time, as always without acquisition. Frames come in the order of their
    /// exposure, each once.
    ///
    /// # Errors
    /// [`CameraError::Gone`] if the camera went away: noticed within two seconds, and again at every later call.
    fn next_frame(&mut self, image: &mut GreyImage, timeout: Duration) -> Result<Option<FrameInfo>, CameraError>;

    /// Its own features and how its link does, for engineers; `None` if it has nothing beyond its settings. Whoever holds
    /// the camera sets nothing by it.
    fn details(&self) -> Option<Arc<dyn CameraDetails>> {
        None
    }

    /// Whether a frame that was exposed is still being computed, so that it is late without being lost. Only a
    /// simulated camera computes its frames; one that hangs computes nothing.
    fn is_computing(&self) -> bool {
        false
    }

    /// Ends acquisition. Works in every state.
    fn stop(&mut self) -> Result<(), CameraError>;

    /// Starts to reach the camera again after [`CameraError::Gone`] and returns at once; other calls tell `Gone`
    /// until it is reached. It comes back stopped, with its settings.
    fn reconnect(&mut self) -> Result<(), CameraError>;
}
