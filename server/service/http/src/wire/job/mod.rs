//! Jobs and what they were asked to do, on the wire.

pub mod job_inputs;
pub mod jobs;
