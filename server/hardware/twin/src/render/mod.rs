//! Rendering of the station and its scene to camera images.

pub(crate) mod exposure;
mod light;
pub mod renderer;
pub(crate) mod sensor;
pub(crate) mod view;
