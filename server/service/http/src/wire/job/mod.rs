//! Jobs and their inputs, on the wire.

pub mod job_inputs;
pub mod jobs;
