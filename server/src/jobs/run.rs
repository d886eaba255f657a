//! From a job's input to the procedure that does it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::jobs::input::JobInput;
use crate::jobs::{Done, JobContext, JobEnd, calibrate, export, recompute, scan, verify};
use crate::problem::{Problem, ProblemKind};

/// Runs the job to its end; a panic is a failure of this job alone.
pub(super) fn run(input: JobInput, context: &JobContext) -> Result<Done, JobEnd> {
    catch_unwind(AssertUnwindSafe(|| run_kind(input, context))).unwrap_or_else(|panic| Err(defect(&*panic)))
}

fn run_kind(input: JobInput, context: &JobContext) -> Result<Done, JobEnd> {
    match input {
        JobInput::Calibration(input) => calibrate::run(input, context),
        JobInput::Scan(input) => scan::run(input, context),
        JobInput::Recomputation(input) => recompute::run(input, context),
        JobInput::Export(input) => export::run(input, context),
        JobInput::Verification(input) => verify::run(input, context),
    }
}

fn defect(panic: &(dyn Any + Send)) -> JobEnd {
    let words = panic.downcast_ref::<&str>().map(|words| (*words).to_owned());
    let words = words.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
    tracing::error!(panic = %words, "a job panicked");
    Problem::new(ProblemKind::Internal, "the job ended by a defect of the program")
        .remedy("report it with the log; other jobs go on")
        .into()
}
