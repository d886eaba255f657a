//! Uploaded captures.

use std::path::PathBuf;

use store::{CaptureRecord, Change};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, event};
use crate::resources::captures::{ArchiveFormat, CaptureOrigin};

/// A received archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Upload {
    /// Its file in the scratch folder of the artifacts; consumed.
    pub archive: PathBuf,
    /// Its archive format.
    pub format: ArchiveFormat,
    /// Its name.
    pub name: String,
}

/// Validates an archive completely and stores it, together with what `and` returns.
///
/// # Errors
/// The archive is not a valid capture, or `and` fails.
pub async fn upload<E: From<AppError>>(
    app: &App,
    by: &Principal,
    input: Upload,
    and: impl FnOnce(&CaptureRecord) -> Result<Vec<Change>, E>,
) -> Result<CaptureRecord, E> {
    let Upload { archive, format, name } = input;
    let captures = app.captures.clone();
    let take_in = move || captures.take_in(&archive, format, CaptureOrigin::Upload, &name);
    let taken = tokio::task::spawn_blocking(take_in).await.map_err(|cause| {
        AppError::new(ErrorKind::Internal, "the archive could not be checked").because(cause.to_string())
    })?;
    let (record, change) = taken?;
    let entry = event(&record.id, Event::CaptureCreated((&record).into()));
    tracing::info!(capture = record.id, principal = Principal::LOCAL, actor = by.actor, "a capture was uploaded");
    let mut changes = vec![change, entry];
    changes.extend(and(&record)?);
    app.catalogue.commit(changes).await.map_err(AppError::from)?;
    Ok(record)
}

/// Deletes a capture.
///
/// # Errors
/// If it does not exist, or a record refers to it.
pub async fn delete_capture(app: &App, by: &Principal, id: String) -> Result<(), AppError> {
    let gone = event(&id, Event::CaptureDeleted(by.initiator()));
    app.catalogue.commit(vec![Change::DeleteCapture(id), gone]).await?;
    Ok(())
}
