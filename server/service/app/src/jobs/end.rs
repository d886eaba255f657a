//! How a job ends that did not come to its end, and which errors end it.

use capture::CaptureError;
use pipeline::Failure;
use scanning::{FileError, ScanError};
use station::StationRefusal;
use store::StoreError;

use crate::error::AppError;
use crate::stored_scan::disk_problem;

/// A job that did not.
#[derive(Debug)]
pub enum JobEnd {
    /// By a person.
    Cancelled,
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
