//! What a job does at this moment, and how far it is.

mod job;
#[cfg(test)]
mod silent;
mod step;

pub use job::{JobReporter, ProgressFn};
pub use step::{Phase, Step};

#[cfg(test)]
pub use silent::Silent;
