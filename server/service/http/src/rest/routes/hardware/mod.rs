//! The station, its devices and who is in control.

pub mod control;
pub mod dark_frame;
pub mod devices;
pub mod features;
pub mod simulation;
pub mod station;
