//! What the simulated station is made of: its shape, its devices with their errors, its light, its randomness.

pub(crate) mod fan;
pub(crate) mod mark;
pub mod poses;
pub(crate) mod psf;
pub(crate) mod random;
pub(crate) mod sensor;
pub mod shape;
pub(crate) mod sheet_map;
pub(crate) mod speckle;
pub mod station;
