//! Errors of the service's parts as [`AppError`]: their kind is decided here, their remedy comes with them.

use std::error::Error;
use std::io;

use calibration::DifferenceError;
use capture::{CaptureError, TargetError};
use remedy::Remedy;
use report::certificate::CertificateError;
use station::StationRefusal;
use store::StoreError;

use crate::error::{AppError, ErrorKind};
use pipeline::{Failure, FailureKind};
use twin::{FaultNameError, PartFileError};

impl From<Failure> for AppError {
    fn from(failure: Failure) -> Self {
        let kind = match failure.kind() {
            FailureKind::Cancelled => ErrorKind::Stopped,
            FailureKind::Internal => ErrorKind::Internal,
            _ => ErrorKind::Impossible,
        };
        let mut problem = Self::new(kind, failure.what());
        if !failure.causes().is_empty() {
            problem = problem.because(failure.causes().join(": "));
        }
        if let Some(entry) = failure.entry() {
            problem = problem.at(entry);
        }
        match failure.advice() {
            // The command-line switch corresponds to a field of the job's input.
            Some(advice) => problem.remedy(advice.replace("--leave-out-unreadable", "leave_out_unreadable")),
            None => problem,
        }
    }
}

impl From<CaptureError> for AppError {
    fn from(error: CaptureError) -> Self {
        Failure::from(error).into()
    }
}

impl From<StoreError> for AppError {
    fn from(error: StoreError) -> Self {
        let kind = match &error {
            StoreError::NotFound { kind: "artifact", id } => return lost_file(id, "the file is missing"),
            StoreError::Damaged { id } => return lost_file(id, "its content does not match its hash"),
            StoreError::NotFound { .. } => ErrorKind::NotFound,
            StoreError::Exists { .. } | StoreError::Refused { .. } => ErrorKind::Conflict,
            StoreError::Changed { .. } => ErrorKind::Changed,
            StoreError::Full => ErrorKind::StorageFull,
            StoreError::ReadOnly { .. } | StoreError::InUse { .. } => ErrorKind::Unavailable,
            StoreError::DamagedRecord { .. } => ErrorKind::Damaged,
            StoreError::NotItsCatalogue { .. }
            | StoreError::TooNew { .. }
            | StoreError::Database { .. }
            | StoreError::Broken { .. }
            | StoreError::File { .. } => ErrorKind::Internal,
        };
        app_error(kind, &error)
    }
}

impl From<CertificateError> for AppError {
    fn from(error: CertificateError) -> Self {
        let refused = app_error(ErrorKind::Impossible, &error);
        match error.remedy() {
            Some(remedy) => refused.remedy(format!("{remedy}; then restart the service")),
            None => refused,
        }
    }
}

impl From<DifferenceError> for AppError {
    fn from(error: DifferenceError) -> Self {
        app_error(ErrorKind::Impossible, &error)
    }
}

impl From<FaultNameError> for AppError {
    fn from(error: FaultNameError) -> Self {
        app_error(ErrorKind::Impossible, &error)
    }
}

impl From<TargetError> for AppError {
    fn from(error: TargetError) -> Self {
        app_error(ErrorKind::Impossible, &error)
    }
}

impl From<PartFileError> for AppError {
    fn from(error: PartFileError) -> Self {
        app_error(ErrorKind::Impossible, &error)
    }
}

/// A file that a record refers to; the caller adds its display name with [`AppError::of_stored`].
fn lost_file(id: &str, why: &str) -> AppError {
    AppError::damaged(&format!("the file {id}"), why)
}

impl From<StationRefusal> for AppError {
    fn from(refusal: StationRefusal) -> Self {
        use devices::{CameraError, LaserError, StageError};
        let kind = match &refusal {
            StationRefusal::Busy { .. } => ErrorKind::StationBusy,
            StationRefusal::Stopped { .. } | StationRefusal::Cancelled => ErrorKind::Stopped,
            StationRefusal::ShuttingDown => ErrorKind::Unavailable,
            StationRefusal::TooManyCommands => ErrorKind::TooMany,
            StationRefusal::Halted => ErrorKind::Halted,
            StationRefusal::NoLiveView => ErrorKind::Conflict,
            StationRefusal::BeltStopped { .. }
            | StationRefusal::Stage(StageError::NotHomed | StageError::Moving) => ErrorKind::Conflict,
            StationRefusal::SpeedOutOfRange { .. }
            | StationRefusal::Stage(
                StageError::OutOfTravel { .. } | StageError::BadNumber { .. } | StageError::NotCommanded { .. },
            )
            | StationRefusal::Camera(CameraError::Unsupported { .. })
            | StationRefusal::Laser(LaserError::BadPower { .. }) => ErrorKind::Impossible,
            StationRefusal::InError { .. }
            | StationRefusal::Absent { .. }
            | StationRefusal::Camera(_)
            | StationRefusal::Stage(_)
            | StationRefusal::Laser(_)
            | StationRefusal::NoFrame { .. } => ErrorKind::DeviceFault,
        };
        app_error(kind, &refusal)
    }
}

fn app_error(kind: ErrorKind, error: &dyn Remedy) -> AppError {
    let mut problem = AppError::new(kind, without_folders(&error.to_string()));
    problem.remedy = error.remedy().map(|remedy| without_folders(&remedy));
    let mut causes = Vec::new();
    let mut next = error.source();
    while let Some(cause) = next {
        causes.push(without_folders(&cause.to_string()));
        next = cause.source();
    }
    if causes.is_empty() { problem } else { problem.because(causes.join(": ")) }
}

/// Clients never see server paths: only the last component of a path is kept.
fn without_folders(text: &str) -> String {
    let name = |word: &str| {
        let (before, path) = word.split_at(word.find('/').unwrap_or(word.len()));
        let opening = before.chars().all(|letter| matches!(letter, '"' | '\'' | '`' | '('));
        match path.rsplit_once('/') {
            Some((folder, name)) if opening && !folder.is_empty() => format!("{before}{name}"),
            _ => word.to_owned(),
        }
    };
    text.split(' ').map(name).collect::<Vec<_>>().join(" ")
}

/// A file could not be written.
pub fn disk_problem(error: impl Error + 'static) -> AppError {
    let mut causes = Vec::new();
    let mut full = false;
    let mut next: Option<&(dyn Error + 'static)> = Some(&error);
    while let Some(cause) = next {
        full |= cause.downcast_ref::<io::Error>().is_some_and(|io| io.kind() == io::ErrorKind::StorageFull);
        causes.push(cause.to_string());
        next = cause.source();
    }
    let (kind, remedy) = match full {
        true => (ErrorKind::StorageFull, "delete captures or scans that are no longer needed"),
        false => (ErrorKind::Internal, "check the disk of the data directory"),
    };
    AppError::new(kind, "a file of the scan could not be written").because(causes.join(": ")).remedy(remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_last_component_of_a_path_is_shown() {
        let reason = "cannot sync /var/lib/sheaf/artifacts/ab: I/O error".to_owned();
        let problem = AppError::from(StoreError::ReadOnly { reason });
        assert_eq!(problem.kind, ErrorKind::Unavailable);
        assert!(problem.detail.contains("cannot sync ab: I/O error"), "{problem:?}");
        let quoted = "cannot open \"/dev/ttyACM0\" at 2 mm/s, 1/2 of it";
        assert_eq!(without_folders(quoted), "cannot open \"ttyACM0\" at 2 mm/s, 1/2 of it");
    }

    #[test]
    fn damaged_and_missing_files_give_the_same_error() {
        let id = "a".repeat(64);
        let damaged = AppError::from(StoreError::Damaged { id: id.clone() }).of_stored("the cloud of scan 7");
        let missing =
            AppError::from(StoreError::NotFound { kind: "artifact", id }).of_stored("the cloud of scan 7");
        assert_eq!((damaged.kind, &damaged.remedy), (missing.kind, &missing.remedy));
        assert!(damaged.detail.contains("cloud of scan 7") && damaged.remedy.unwrap().contains("restore"));
        let scan = AppError::from(StoreError::NotFound { kind: "scan", id: "7".into() }).of_stored("the cloud");
        assert_eq!(scan.kind, ErrorKind::NotFound);
    }

    #[test]
    fn the_remedy_is_separate_from_the_message_and_the_cause_is_kept() {
        let cause = std::io::Error::other("no such device");
        let error = StoreError::File { what: "write", path: "x".into(), cause };
        let problem = AppError::from(error);
        assert_eq!((problem.kind, problem.cause.as_deref()), (ErrorKind::Internal, Some("no such device")));
        // Text that looks like a remedy is not one.
        let reason = "disk 1; disk 2".to_owned();
        let problem = AppError::from(StoreError::ReadOnly { reason });
        assert!(problem.detail.ends_with("(disk 1; disk 2)"), "{problem:?}");
        assert_eq!(problem.remedy.as_deref(), Some("check the disk, then restart"));
        let problem = AppError::from(StationRefusal::Stage(devices::StageError::NotHomed));
        assert_eq!((problem.kind, problem.remedy.as_deref()), (ErrorKind::Conflict, Some("home the stage first")));
        // Nor is text within a device message.
        let meaning = "a limit switch was hit; the position is lost".to_owned();
        let problem = AppError::from(StationRefusal::Stage(devices::StageError::Alarm { code: 1, meaning }));
        assert!(problem.detail.ends_with("(a limit switch was hit; the position is lost)"), "{problem:?}");
        assert_eq!(problem.remedy.as_deref(), Some("remove the cause, clear the alarm and home the stage"));
    }
}
