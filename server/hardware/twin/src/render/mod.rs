//! From the station and what lies on it to the picture that its camera takes.

pub(crate) mod ball_block;
pub(crate) mod band;
pub(crate) mod block;
pub(crate) mod board_image;
pub(crate) mod exposure;
pub(crate) mod freeform_block;
pub(crate) mod laser_image;
pub(crate) mod lit_pixels;
pub(crate) mod mark;
pub(crate) mod mesh_light;
pub(crate) mod mesh_view;
pub mod renderer;
pub(crate) mod seen;
pub(crate) mod sensor;
pub(crate) mod sheet_map;
pub(crate) mod trace;
pub(crate) mod ways;
