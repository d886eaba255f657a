//! Commands on single images and pixels, and the board to print.

pub mod centrelines;
pub mod corners;
pub mod target;
pub mod triangulate;
