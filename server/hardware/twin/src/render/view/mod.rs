//! Surfaces seen by the camera's pixels, and the light they receive.

pub(crate) mod ball_block;
pub(crate) mod block;
pub(crate) mod board_image;
pub(crate) mod freeform_block;
pub(crate) mod laser_image;
pub(crate) mod lit_pixels;
pub(crate) mod mesh_view;
pub(crate) mod pixel_hits;
