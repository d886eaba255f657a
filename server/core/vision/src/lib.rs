//! Image in, sub-pixel points with standard deviations out: laser centrelines and board corners.
//!
//! Pixel (0, 0) is the centre of the top-left pixel; u runs along rows (right), v down columns. Cameras, gratings and
//! millimetres do not belong here.

pub mod centreline;
pub mod colour;
pub mod corners;
pub mod dark_frame;
pub mod image;
pub mod laser_channel;
pub mod params;
mod room;

pub use centreline::{
    CentrelineExtractor, CentrelineMethod, CentrelineParams, CentrelinePoint, Centrelines, LineDirection, Segment,
    find_centrelines,
};
pub use colour::{Channel, ColourImage, Picture};
pub use corners::{
    BoardCorners, CharucoError, CharucoParams, CircleParams, Corner, CornerError, CornerParams, find_charuco,
    find_circles, find_corners,
};
pub use dark_frame::{Correction, DarkFigures, DarkFrame, DarkFrameError, DarkFrames};
pub use image::{GreyImage, ImageError, LevelsMut, Pixels};
pub use laser_channel::{ChannelView, laser_channel};
pub use room::{RoomChange, room_change};
