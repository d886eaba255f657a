//! Inspections on the wire.

pub mod comparison;
pub mod evaluation;
pub mod inspections;
pub mod requests;
pub mod results;
