//! What a station is built from: camera, stage and laser as traits, and the drivers that make them.

pub mod camera;
pub mod driver;
pub mod features;
pub mod identity;
pub mod laser;
pub mod stage;
pub mod stop_handle;
