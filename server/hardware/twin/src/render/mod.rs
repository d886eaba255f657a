//! From the station and what lies on it to the picture that its camera takes.

pub(crate) mod exposure;
mod light;
pub mod renderer;
pub(crate) mod sensor;
pub(crate) mod view;
