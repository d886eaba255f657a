//! The outcome of a job as serialisable values, and which errors end a job.

use capture::CaptureError;
use pipeline::Failure;
use scanning::{FileError, ScanError};
use serde::{Deserialize, Serialize};
use station::StationRefusal;
use store::{Change, ResultRef, StoreError};

use crate::error::AppError;
use crate::error::disk_problem;

/// A completed job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// Its result.
    pub result: ResultRef,
    /// Final message for the operator.
    pub message: String,
    /// Stored in the same transaction as its end.
    pub changes: Vec<Change>,
    /// The scan whose work folder can be removed once this is stored; needed only after an earlier crash.
    pub finished_work: Option<String>,
}

/// A job that did not complete.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum JobEnd {
    /// Cancelled by a user.
    Cancelled,
    /// Cancelled by a user after it had produced something that is kept.
    CancelledAfter(Box<Done>),
    /// Failed.
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
    /// Stop and cancellation count as cancelled by a user; everything else is a failure.
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
    fn a_stopped_job_was_cancelled_and_did_not_fail() {
        let stopped = StationRefusal::Stopped { actor: "A".into() };
        assert!(matches!(JobEnd::from(stopped), JobEnd::Cancelled));
        assert!(matches!(JobEnd::from(Failure::cancelled()), JobEnd::Cancelled));
        assert!(matches!(JobEnd::from(StationRefusal::ShuttingDown), JobEnd::Failed(_)));
    }
}
