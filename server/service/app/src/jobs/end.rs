//! What comes of a job, as values that survive the way from one process to another; and which errors end one.

use capture::CaptureError;
use pipeline::Failure;
use scanning::{FileError, ScanError};
use serde::{Deserialize, Serialize};
use station::StationRefusal;
use store::{Change, ResultRef, StoreError};

use crate::error::AppError;
use crate::resources::stored_scan::disk_problem;

/// A job that came to its end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// What it made.
    pub result: ResultRef,
    /// Last words to the operator.
    pub message: String,
    /// Stored in the same transaction as its end.
    pub changes: Vec<Change>,
    /// The scan whose folder of work is of no use any more once that is stored: only a crash before needs it.
    pub finished_work: Option<String>,
}

/// A job that did not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum JobEnd {
    /// By a person.
    Cancelled,
    /// By a person, after it had made something that is kept.
    CancelledAfter(Box<Done>),
    /// With a reason.
    Failed(Box<AppError>),
}

impl From<AppError> for JobEnd {
    fn from(problem: AppError) -> Self {
        Self::Failed(Box::new(problem))
    }
}

impl From<FileError> for JobEnd {
    fn from(error: FileError) -> Self {
        disk_problem(error).into()
    }
}

impl From<ScanError> for JobEnd {
    fn from(error: ScanError) -> Self {
        Failure::from(error).into()
    }
}

impl From<Failure> for JobEnd {
    fn from(failure: Failure) -> Self {
        if failure.is_cancelled() { Self::Cancelled } else { AppError::from(failure).into() }
    }
}

impl From<CaptureError> for JobEnd {
    fn from(error: CaptureError) -> Self {
        AppError::from(error).into()
    }
}

impl From<StoreError> for JobEnd {
    fn from(error: StoreError) -> Self {
        AppError::from(error).into()
    }
}

impl From<StationRefusal> for JobEnd {
    /// Stop and cancellation are how a person ends a job; everything else is a failure.
    fn from(refusal: StationRefusal) -> Self {
        match refusal {
            StationRefusal::Cancelled | StationRefusal::Stopped { .. } => Self::Cancelled,
            other => AppError::from(other).into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stopped_job_was_ended_by_a_person_and_did_not_fail() {
        let stopped = StationRefusal::Stopped { actor: "A".into() };
        assert!(matches!(JobEnd::from(stopped), JobEnd::Cancelled));
        assert!(matches!(JobEnd::from(Failure::cancelled()), JobEnd::Cancelled));
        assert!(matches!(JobEnd::from(StationRefusal::ShuttingDown), JobEnd::Failed(_)));
    }
}
