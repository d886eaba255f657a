//! Starting, stopping and deleting recordings.

use std::time::Instant;

use station::{MachineState, OperationalState};
use store::{Change, RecordingRecord, RecordingState};

use crate::App;
use crate::access::principal::Principal;
use crate::control::{Request, admit};
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, event};
use crate::recordings::RecordingOf;
use crate::recordings::figures::Ended;
use crate::resources::labels::label;

/// Records the live view until the recording is stopped or the live view ends; stores with it what `and` returns.
///
/// # Errors
/// The caller may not use the station, there is no live view, another recording runs, or the disk is full.
pub async fn start_recording<E: From<AppError>>(
    app: &App,
    by: &Principal,
    name: &str,
    and: impl FnOnce(&RecordingRecord) -> Result<Vec<Change>, E>,
) -> Result<RecordingRecord, E> {
    label(name, "/name")?;
    admit(app, by, Request::Command)?;
    let live = MachineState::Operational(OperationalState::ContinuousExecution);
    if app.station.status().state != live {
        return Err(AppError::new(ErrorKind::Conflict, "there is no live view to record")
            .remedy("start the live view first, or scan with record: true")
            .into());
    }
    app.recordings.begin(name, RecordingOf::Live, Some(&by.actor), and).await
}

/// Stops a recording and returns it with its file. A recording that has ended is returned unchanged.
///
/// # Errors
/// The caller is not in control, or the recording does not exist.
pub async fn stop_recording(app: &App, by: &Principal, id: &str) -> Result<RecordingRecord, AppError> {
    app.control.command(by.control_id.as_deref(), Instant::now())?;
    let ended = app.recordings.end(Some(id), Ended::Stopped).await;
    match ended {
        Some(record) => Ok(record),
        None => Ok(app.recordings.now(app.catalogue.read().recording(id).await?)),
    }
}

/// Deletes a recording; its disk space is freed by the next sweep.
///
/// # Errors
/// If it does not exist or is not finished.
pub async fn delete_recording(app: &App, by: &Principal, id: String) -> Result<(), AppError> {
    let record = app.catalogue.read().recording(&id).await;
    if let Ok(RecordingRecord { state: RecordingState::Recording | RecordingState::Finishing, .. }) = record {
        return Err(AppError::new(ErrorKind::Conflict, format!("recording {id} is not finished"))
            .remedy("stop it first, and wait until its file is complete"));
    }
    let gone = event(&id, Event::RecordingDeleted(by.initiator()));
    app.catalogue.commit(vec![Change::DeleteRecording(id), gone]).await?;
    Ok(())
}
