//! Calibrations and the sessions that make them, on the wire.

pub mod calibration_documents;
pub mod calibration_summaries;
pub mod calibrations;
pub mod differences;
pub mod projector;
pub mod residuals;
pub mod session_bodies;
pub mod sessions;
pub mod target;
