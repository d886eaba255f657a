//! Errors of the service's parts as problems, and problems as ends of jobs.
//!
//! Every message of the parts says what is wrong and, after its last semicolon or colon, what to do about it.

use std::error::Error;

use capture::CaptureError;
use store::StoreError;

use crate::failure::{Exit, Failure};
use crate::jobs::JobEnd;
use crate::problem::{Problem, ProblemKind};
use crate::station::StationRefusal;

impl From<Failure> for Problem {
    fn from(failure: Failure) -> Self {
        let kind = match failure.exit() {
            _ if failure.is_cancelled() => ProblemKind::Stopped,
            Exit::Internal => ProblemKind::Internal,
            _ => ProblemKind::Impossible,
        };
        let mut problem = Self::new(kind, failure.what());
        if !failure.causes().is_empty() {
            problem = problem.because(failure.causes().join(": "));
        }
        if let Some(entry) = failure.entry() {
            problem = problem.at(entry);
        }
        match failure.advice() {
            // The command line's switch is a field of the job's input.
            Some(advice) => problem.remedy(advice.replace("--leave-out-unreadable", "leave_out_unreadable")),
            None => problem,
        }
    }
}

impl From<CaptureError> for Problem {
    fn from(error: CaptureError) -> Self {
        Failure::from(error).into()
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        let kind = match &error {
            StoreError::NotFound { .. } => ProblemKind::NotFound,
            StoreError::Exists { .. } | StoreError::Refused { .. } => ProblemKind::Conflict,
            StoreError::Changed { .. } => ProblemKind::Changed,
            StoreError::Full => ProblemKind::StorageFull,
            StoreError::ReadOnly { .. } | StoreError::InUse { .. } => ProblemKind::Unavailable,
            StoreError::Damaged { .. }
            | StoreError::DamagedRecord { .. }
            | StoreError::TooNew { .. }
            | StoreError::Database { .. }
            | StoreError::File { .. } => ProblemKind::Internal,
        };
        told(kind, &error)
    }
}

impl From<StationRefusal> for Problem {
    fn from(refusal: StationRefusal) -> Self {
        use devices::{CameraError, LaserError, StageError};
        let kind = match &refusal {
            StationRefusal::Busy { .. } => ProblemKind::StationBusy,
            StationRefusal::Stopped { .. } | StationRefusal::Cancelled => ProblemKind::Stopped,
            StationRefusal::ShuttingDown => ProblemKind::Unavailable,
            StationRefusal::TooManyCommands => ProblemKind::TooMany,
            StationRefusal::Halted => ProblemKind::Halted,
            StationRefusal::NoLiveView => ProblemKind::Conflict,
            StationRefusal::Stage(StageError::NotHomed | StageError::Moving) => ProblemKind::Conflict,
            StationRefusal::SpeedOutOfRange { .. }
            | StationRefusal::Stage(StageError::OutOfTravel { .. } | StageError::BadNumber { .. })
            | StationRefusal::Camera(CameraError::Unsupported { .. })
            | StationRefusal::Laser(LaserError::BadPower { .. }) => ProblemKind::Impossible,
            StationRefusal::InError { .. }
            | StationRefusal::Absent { .. }
            | StationRefusal::Camera(_)
            | StationRefusal::Stage(_)
            | StationRefusal::Laser(_)
            | StationRefusal::NoFrame { .. } => ProblemKind::DeviceFault,
        };
        told(kind, &refusal)
    }
}

impl From<Failure> for JobEnd {
    fn from(failure: Failure) -> Self {
        if failure.is_cancelled() { Self::Cancelled } else { Problem::from(failure).into() }
    }
}

impl From<CaptureError> for JobEnd {
    fn from(error: CaptureError) -> Self {
        Problem::from(error).into()
    }
}

impl From<StoreError> for JobEnd {
    fn from(error: StoreError) -> Self {
        Problem::from(error).into()
    }
}

impl From<StationRefusal> for JobEnd {
    /// Stop and cancellation are how a person ends a job; everything else is a failure.
    fn from(refusal: StationRefusal) -> Self {
        match refusal {
            StationRefusal::Cancelled | StationRefusal::Stopped { .. } => Self::Cancelled,
            other => Problem::from(other).into(),
        }
    }
}

fn told(kind: ProblemKind, error: &dyn Error) -> Problem {
    let text = error.to_string();
    let problem = match text.split_once("; ") {
        Some((what, remedy)) => Problem::new(kind, what).remedy(remedy),
        None => Problem::new(kind, text),
    };
    let mut causes = Vec::new();
    let mut next = error.source();
    while let Some(cause) = next {
        causes.push(cause.to_string());
        next = cause.source();
    }
    if causes.is_empty() { problem } else { problem.because(causes.join(": ")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remedy_is_split_from_the_message_and_the_cause_is_kept() {
        let cause = std::io::Error::other("no such device");
        let error = StoreError::File { what: "write", path: "x".into(), cause };
        let problem = Problem::from(error);
        assert_eq!((problem.status, problem.cause.as_deref()), (500, Some("no such device")));
        let problem = Problem::from(StationRefusal::Stage(devices::StageError::NotHomed));
        assert_eq!((problem.status, problem.remedy.as_deref()), (409, Some("home it first")));
    }

    #[test]
    fn a_stopped_job_was_ended_by_a_person_and_did_not_fail() {
        let stopped = StationRefusal::Stopped { actor: "A".into() };
        assert!(matches!(JobEnd::from(stopped), JobEnd::Cancelled));
        assert!(matches!(JobEnd::from(Failure::cancelled()), JobEnd::Cancelled));
        assert!(matches!(JobEnd::from(StationRefusal::ShuttingDown), JobEnd::Failed(_)));
    }
}
