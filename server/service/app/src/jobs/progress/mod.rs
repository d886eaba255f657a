//! Current step and progress of a job.

mod job;
#[cfg(test)]
mod silent;
mod step;

pub use job::{JobReporter, ProgressFn, Warnings};
pub use step::{Phase, Step};

#[cfg(test)]
pub use silent::Silent;
