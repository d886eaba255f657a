//! Inspections on the wire.

pub mod inspections;
pub mod requests;
pub mod results;
