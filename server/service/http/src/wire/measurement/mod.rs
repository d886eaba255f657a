//! Measurements, their results and the measurement plan, on the wire.

pub mod measurement_plan;
pub mod measurement_results;
pub mod measurements;
pub mod models;
