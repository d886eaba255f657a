//! Frames from the station: captured, ambient light subtracted, lines extracted, written to disk.

pub mod acquisition;
pub mod backgrounds;
pub mod recording;
pub mod writing;
