//! The devices of a station: camera, stage and laser as traits, and the drivers that create them.

pub mod camera;
pub mod driver;
pub mod features;
pub mod identity;
pub mod laser;
pub mod stage;
pub mod stop_handle;
