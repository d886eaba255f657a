//! `[station.v4l2]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[station.v4l2]`: a USB (UVC) or other Video4Linux2 camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct V4l2Settings {
    /// device file of the camera, as `sheaf devices` lists it
    pub device: String,
    /// pixel format for 8 bits: GREY, YUYV or MJPG; empty: the first of these it has
    pub format_8: String,
    /// pixel format for more bits: Y16, Y12 or Y10; empty: the first of these it has
    pub format_16: String,
    /// what is used of a colour image (YUYV, MJPG): its luma, or the colour of the laser
    #[schemars(with = "String", extend("enum" = ["luma", "red", "green", "blue"]))]
    pub channel: CameraChannel,
    /// columns of the image; 0: those of the largest image
    pub width_px: usize,
    /// rows of the image; 0: those of the largest image
    pub height_px: usize,
    /// gain in the camera's own unit, clamped to its range
    pub gain: i32,
    /// number of frame buffers
    #[schemars(range(min = 2, max = 32))]
    pub buffers: u32,
}

/// The channel used of a colour image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraChannel {
    /// As the camera sends it, in full resolution.
    #[default]
    Luma,
    /// Red.
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
}

impl Default for V4l2Settings {
    /// Best format, largest image, lowest gain; the device file must be configured.
    fn default() -> Self {
        Self {
            device: String::new(),
            format_8: String::new(),
            format_16: String::new(),
            channel: CameraChannel::default(),
            width_px: 0,
            height_px: 0,
            gain: 0,
            buffers: 8,
        }
    }
}
