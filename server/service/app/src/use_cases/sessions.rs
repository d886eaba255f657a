//! Calibration sessions.

use optics::StagePosition;
use store::{Change, JobRecord};

use crate::App;
use crate::access::principal::Principal;
use crate::control::{Request, admit};
use crate::error::AppError;
use crate::jobs::calibrate::{SolveSession, solve_input};
use crate::resources::calibrations::used_station::UsedStation;
use crate::sessions::image_capture::Exposures;
use crate::sessions::{NewSession, Session};
use crate::use_cases::jobs::start_job;

/// Creates a session, together with what `and` returns.
///
/// # Errors
/// An invalid board, projector or exposure.
pub async fn create_session(
    app: &App,
    by: &Principal,
    new: NewSession,
    and: impl FnOnce(&Session) -> Vec<Change>,
) -> Result<Session, AppError> {
    app.sessions.create_with(by, new, and).await
}

/// Captures the board as held now. `expected`: refused unless the session has this version.
///
/// # Errors
/// The caller may not use the station, the session is full, or a device refuses.
pub async fn capture_pose(
    app: &App,
    by: &Principal,
    id: &str,
    expected: Option<i64>,
) -> Result<Session, AppError> {
    app.sessions.get(id).await?;
    admit(app, by, Request::SessionImage)?;
    app.sessions.add_pose(by, id, expected).await
}

/// Moves the stage to a position and captures the board on it.
///
/// # Errors
/// As [`capture_pose`].
pub async fn capture_stage_view(
    app: &App,
    by: &Principal,
    id: &str,
    position: StagePosition,
    expected: Option<i64>,
) -> Result<Session, AppError> {
    app.sessions.get(id).await?;
    admit(app, by, Request::SessionImage)?;
    app.sessions.add_stage_view(by, id, position, expected).await
}

/// Changes the exposure settings of the images to come.
///
/// # Errors
/// If a setting is out of range, the session does not exist, or it was changed in the meantime.
pub async fn set_session_exposures(
    app: &App,
    by: &Principal,
    id: &str,
    exposures: Exposures,
    expected: Option<i64>,
) -> Result<Session, AppError> {
    app.sessions.set_exposures(by, id, exposures, expected).await
}

/// Deletes a pose.
///
/// # Errors
/// If it does not exist, or the session was changed in the meantime.
pub async fn delete_pose(
    app: &App,
    by: &Principal,
    (id, pose_id): (&str, &str),
    expected: Option<i64>,
) -> Result<Session, AppError> {
    app.sessions.delete_pose(by, id, pose_id, expected).await
}

/// Deletes a stage view.
///
/// # Errors
/// If it does not exist, or the session was changed in the meantime.
pub async fn delete_stage_view(
    app: &App,
    by: &Principal,
    (id, view_id): (&str, &str),
    expected: Option<i64>,
) -> Result<Session, AppError> {
    app.sessions.delete_stage_view(by, id, view_id, expected).await
}

/// Deletes a session; calibrations computed from it are kept.
///
/// # Errors
/// If it does not exist.
pub async fn delete_session(app: &App, by: &Principal, id: &str) -> Result<(), AppError> {
    app.sessions.delete(by, id).await
}

/// Starts the calibration from the session's usable images.
///
/// # Errors
/// Too few usable images; as [`start_job`].
pub async fn solve_session(
    app: &App,
    by: &Principal,
    id: &str,
    how: SolveSession,
    and: impl FnOnce(&JobRecord) -> Vec<Change>,
) -> Result<JobRecord, AppError> {
    let used = UsedStation::of(&app.station.status());
    let how = SolveSession { station: Some(used), ..how };
    let input = solve_input(&app.sessions, id, how).await?;
    let record = start_job(app, by, input, and).await?;
    app.sessions.note_job(by, id, &record.id).await?;
    Ok(record)
}
