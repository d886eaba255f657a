//! Dispatches a job to its procedure.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use crate::error::{AppError, ErrorKind};
use crate::jobs::input::JobInput;
use crate::jobs::{Done, Job, JobEnd, StationContext};

/// Executes jobs on the calling thread.
pub(in crate::jobs) type Procedure = Arc<dyn Fn(JobInput, &StationContext) -> Result<Done, JobEnd> + Send + Sync>;

/// Runs the job; a panic fails only this job. What its procedures warned of ends the message.
pub(in crate::jobs) fn run(
    procedure: &Procedure,
    input: JobInput,
    context: &StationContext,
) -> Result<Done, JobEnd> {
    let end = catch_unwind(AssertUnwindSafe(|| procedure(input, context)));
    let done = end.unwrap_or_else(|panic| Err(defect(&*panic)))?;
    Ok(Done { message: context.warnings.after(&done.message), ..done })
}

/// The procedure for each kind of job; computations have no access to the station.
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
    AppError::new(ErrorKind::Internal, "the job failed with an internal error")
        .remedy("report it together with the server log; other jobs continue")
        .into()
}
