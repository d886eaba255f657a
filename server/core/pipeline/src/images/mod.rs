//! From images to boards and lines, with findings about the images.

pub mod background;
pub mod board;
pub mod features;
pub mod findings;
pub mod lines;
mod projected;
pub mod search;
pub mod strong_light;
