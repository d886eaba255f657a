//! What the simulated station is made of: its shape, its devices with their errors, its light, its randomness.

pub(crate) mod fan;
pub(crate) mod psf;
pub(crate) mod random;
pub mod shape;
pub(crate) mod speckle;
pub mod station;
