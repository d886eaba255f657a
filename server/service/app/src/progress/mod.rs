//! What a job does at this moment, and how far it is.

mod job;
mod step;

pub use job::{JobReporter, ProgressFn};
pub use step::{Phase, Step};
