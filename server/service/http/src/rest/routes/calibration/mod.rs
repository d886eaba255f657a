//! Calibrations and the sessions that make them.

pub mod calibrations;
pub mod sessions;
