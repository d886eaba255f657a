//! The station, its devices and who is in control, on the wire.

pub mod control;
pub mod dark_frame;
pub mod devices;
pub mod features;
pub mod simulation;
pub mod station;
