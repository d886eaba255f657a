//! Inspections on the wire.

pub mod evaluation;
pub mod inspections;
pub mod requests;
pub mod results;
