//! Sub-pixel laser centrelines and board corners from images, with standard deviations.
//!
//! Pixel (0, 0) is the centre of the top-left pixel; u runs along rows (right), v down columns. Cameras, gratings and
//! millimetres do not belong here.

// Tests that are compiled into the library's own tests too name it as a client does.
#[cfg(test)]
extern crate self as vision;

pub mod centreline;
pub mod colour;
pub mod corners;
pub mod dark_frame;
pub mod image;
pub mod laser_channel;
pub mod params;
mod scene_change;
pub mod white_level;

pub use centreline::{
    AveragingBias, CentrelineExtractor, CentrelineMethod, CentrelineParams, CentrelinePoint, Centrelines,
    LineDirection, Segment, find_centrelines,
};
pub use colour::{CameraImage, Channel, ColourImage};
pub use corners::{
    BoardCorners, CharucoError, CharucoParams, CircleParams, Corner, CornerError, CornerParams, find_charuco,
    find_circles, find_corners,
};
pub use dark_frame::{Correction, DarkFrame, DarkFrameAccumulator, DarkFrameError, DarkFrameStatistics};
pub use image::{GreyImage, ImageError, LevelsMut, Pixels};
pub use laser_channel::{ChannelScore, laser_channel};
pub use scene_change::{SceneChange, SceneComparison, scene_change};
pub use white_level::WhiteLevel;
