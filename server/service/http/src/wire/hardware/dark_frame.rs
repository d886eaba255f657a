//! The camera's dark frame on the wire.

use app::camera::dark_frame::KeptDarkFrame;
use serde::{Deserialize, Serialize};
use station::DarkFrameUse;
use utoipa::ToSchema;

/// Hot pixels listed at most.
const LISTED: usize = 1000;

/// How frames are corrected for what the sensor shows without light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DarkFrameUseDto {
    /// Not corrected: no dark frame was taken.
    NoDarkFrame,
    /// Not corrected: the dark frame is of another camera.
    OtherCamera,
    /// Not corrected: the dark frame does not cover the region of interest or has another pixel format.
    OtherFormat,
    /// Hot pixels are replaced; the fixed pattern is of another gain and is not subtracted.
    HotPixels,
    /// The fixed pattern is subtracted and hot pixels are replaced.
    #[serde(alias = "whole")]
    Full,
}

/// Request to take a dark frame.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TakeDarkFrameDto {
    /// Frames to average; 32 if absent.
    #[schema(minimum = 8, maximum = 256)]
    pub n_frames: Option<usize>,
}

/// The camera's dark frame: mean of frames without light. Levels are grey levels of its bit depth.
#[derive(Debug, Serialize, ToSchema)]
pub struct DarkFrameDto {
    /// Whether frames at the current settings are corrected by it.
    pub used: DarkFrameUseDto,
    /// When it was taken.
    pub taken_at_ms: i64,
    /// Model of the camera.
    pub camera_model: String,
    /// Serial number of the camera; empty if unknown.
    pub camera_serial: String,
    /// Exposure time. At longer exposures there may be more hot pixels.
    pub exposure_us: f64,
    /// Gain.
    pub gain_db: f64,
    /// Frames averaged.
    pub n_frames: usize,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Bits per pixel: 8 or 16.
    pub bit_depth: u32,
    /// Level common to all pixels. It is not subtracted.
    pub level: f64,
    /// Standard deviation of a pixel from frame to frame.
    pub noise: f64,
    /// Standard deviation of the fixed pattern, which is subtracted.
    pub pattern: f64,
    /// A pixel is hot if it exceeds its row and column by more than this …
    pub hot_above: f64,
    /// … or if its standard deviation from frame to frame exceeds this.
    pub hot_noise_above: f64,
    /// Number of hot pixels.
    pub n_hot_pixels: usize,
    /// Column and row of the first thousand hot pixels.
    pub hot_pixels: Vec<[usize; 2]>,
}

impl DarkFrameDto {
    /// A dark frame and how it is used now.
    pub fn new(kept: &KeptDarkFrame, used: DarkFrameUse) -> Self {
        let dark = &kept.dark;
        let figures = dark.frame.statistics();
        Self {
            used: used.into(),
            taken_at_ms: dark.taken_at_ms,
            camera_model: dark.camera.model.clone(),
            camera_serial: dark.camera.serial.clone(),
            exposure_us: dark.exposure_us,
            gain_db: dark.gain_db,
            n_frames: figures.n_frames,
            width_px: dark.frame.width(),
            height_px: dark.frame.height(),
            bit_depth: figures.bit_depth,
            level: figures.level,
            noise: figures.noise,
            pattern: figures.pattern,
            hot_above: figures.hot_above,
            hot_noise_above: figures.hot_noise_above,
            n_hot_pixels: dark.frame.hot_pixels().len(),
            hot_pixels: dark.frame.hot_pixels().take(LISTED).map(|(u, v)| [u, v]).collect(),
        }
    }
}

impl From<DarkFrameUse> for DarkFrameUseDto {
    fn from(used: DarkFrameUse) -> Self {
        match used {
            DarkFrameUse::NoDarkFrame => Self::NoDarkFrame,
            DarkFrameUse::OtherCamera => Self::OtherCamera,
            DarkFrameUse::OtherFormat => Self::OtherFormat,
            DarkFrameUse::HotPixels => Self::HotPixels,
            DarkFrameUse::Full => Self::Full,
        }
    }
}
