//! From a job's input to the procedure that does it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use crate::error::{AppError, ErrorKind};
use crate::jobs::input::JobInput;
use crate::jobs::{Done, Job, JobEnd, StationContext};

/// What does a job, on the thread that calls it.
pub(in crate::jobs) type Procedure = Arc<dyn Fn(JobInput, &StationContext) -> Result<Done, JobEnd> + Send + Sync>;

/// Runs the job to its end; a panic is a failure of this job alone.
pub(in crate::jobs) fn run(
    procedure: &Procedure,
    input: JobInput,
    context: &StationContext,
) -> Result<Done, JobEnd> {
    catch_unwind(AssertUnwindSafe(|| procedure(input, context))).unwrap_or_else(|panic| Err(defect(&*panic)))
}

/// The procedure of every kind of job: one that only computes never sees the station.
pub(in crate::jobs) fn by_kind(input: JobInput, context: &StationContext) -> Result<Done, JobEnd> {
    match Job::from(input) {
        Job::Station(job) => job.run(context),
        Job::Compute(job) => job.run(&context.compute),
    }
}

fn defect(panic: &(dyn Any + Send)) -> JobEnd {
    let words = panic.downcast_ref::<&str>().map(|words| (*words).to_owned());
    let words = words.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    tracing::error!(panic = %words, "a job panicked");
    AppError::new(ErrorKind::Internal, "the job ended by a defect of the program")
        .remedy("report it with the log; other jobs go on")
        .into()
}
