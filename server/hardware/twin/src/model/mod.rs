//! Model of the simulated station: shape, devices with their errors, light, randomness.

pub(crate) mod fan;
pub(crate) mod psf;
pub(crate) mod random;
pub mod shape;
pub(crate) mod speckle;
pub mod station;
