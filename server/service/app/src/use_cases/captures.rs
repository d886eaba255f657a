//! Captures from outside.

use std::path::PathBuf;

use store::{CaptureRecord, Change};

use crate::App;
use crate::access::principal::Principal;
use crate::error::{AppError, ErrorKind};
use crate::events::{Event, event};
use crate::resources::captures::{ArchiveFormat, CaptureOrigin};

/// An archive that was received.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Upload {
    /// Its file, under the artifacts' scratch folder; gone afterwards.
    pub archive: PathBuf,
    /// How it is packed.
    pub format: ArchiveFormat,
    /// What a person calls it.
    pub name: String,
}

/// Checks an archive down to the last pixel and keeps it, together with what `and` returns.
///
/// # Errors
/// An archive that is no capture, or what `and` says.
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
    let told = event(&record.id, Event::CaptureCreated((&record).into()));
    tracing::info!(capture = record.id, principal = Principal::LOCAL, actor = by.actor, "a capture was uploaded");
    let mut changes = vec![change, told];
    changes.extend(and(&record)?);
    app.ledger.commit(changes).await.map_err(AppError::from)?;
    Ok(record)
}

/// Forgets a capture.
///
/// # Errors
/// If there is none, or a record needs it.
pub async fn delete_capture(app: &App, by: &Principal, id: String) -> Result<(), AppError> {
    let gone = event(&id, Event::CaptureDeleted(by.act()));
    app.ledger.commit(vec![Change::DeleteCapture(id), gone]).await?;
    Ok(())
}
