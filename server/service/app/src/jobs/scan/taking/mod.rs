//! Frames on their way from the station: taken row by row, freed of ambient light, made into lines, written down.

pub mod acquisition;
pub mod backgrounds;
pub mod recording;
pub mod writing;
