//! Storing a recording after its end or after a crash.

use std::path::{Path, PathBuf};

use recording::{RecordingFile, repair};
use remedy::with_causes;
use store::{Artifacts, Change, FinishedFile, Page, RecordingRecord, RecordingState, StoreError};
use tokio::task::JoinError;

use crate::config::limits::FREE_FLOOR_BYTES;
use crate::error::AppError;
use crate::events::{Event, RecordingEnded, event};
use crate::recordings::figures::{Ended, RecordingFigures};
use crate::recordings::writing::Written;
use crate::recordings::{RecordingParts, code, stored};

/// Folder of running recordings, beside the artifacts.
const FOLDER: &str = "recordings";

/// Page size when searching for recordings of a crashed process.
const PAGE: u32 = 200;

/// Where a recording is written.
pub fn path_of(artifacts: &dyn Artifacts, id: &str) -> PathBuf {
    artifacts.workbench().kept(FOLDER).join(format!("{id}.mcap"))
}

/// Removes the file.
pub fn remove(path: &Path) {
    if let Err(cause) = std::fs::remove_file(path)
        && cause.kind() != std::io::ErrorKind::NotFound
    {
        tracing::warn!(%cause, "the work file of a recording cannot be removed");
    }
}

/// The bytes of the calibration document.
pub async fn calibration_bytes(parts: &RecordingParts, id: &str) -> Result<Vec<u8>, AppError> {
    let record = parts.catalogue.read().calibration(id).await?;
    let what = format!("the document of calibration {id}");
    parts.artifacts.read(&record.document).await.map_err(|error| AppError::from(error).of_stored(&what))
}

/// Stores the file as an artifact and records how the recording ended.
pub async fn keep(
    parts: &RecordingParts,
    record: RecordingRecord,
    path: &Path,
    written: Result<Written, JoinError>,
) -> RecordingRecord {
    match written {
        Ok(Written { figures, is_complete: true }) => {
            store_file(parts, record, path, figures, RecordingState::Complete).await
        }
        Ok(Written { figures, is_complete: false }) => {
            store_file(parts, record, path, figures, RecordingState::Interrupted).await
        }
        Err(defect) => {
            tracing::error!(%defect, "an internal error ended a recording");
            repair_and_store(parts, record, path).await
        }
    }
}

/// The recordings of a crashed process; unreferenced files are deleted.
pub async fn interrupted(parts: &RecordingParts) -> Vec<RecordingRecord> {
    let left = match unfinished(parts).await {
        Ok(left) => left,
        Err(error) => {
            tracing::error!(%error, "interrupted recordings cannot be listed");
            return Vec::new();
        }
    };
    let named: Vec<PathBuf> = left.iter().map(|record| path_of(&*parts.artifacts, &record.id)).collect();
    if let Ok(files) = std::fs::read_dir(parts.artifacts.workbench().kept(FOLDER)) {
        let nameless = files.flatten().map(|file| file.path()).filter(|path| !named.contains(path));
        nameless.for_each(|path| remove(&path));
    }
    left
}

/// Stores the recording of a crashed process as an artifact.
pub async fn store_interrupted(parts: &RecordingParts, record: RecordingRecord) {
    let path = path_of(&*parts.artifacts, &record.id);
    repair_and_store(parts, record, &path).await;
}

async fn unfinished(parts: &RecordingParts) -> Result<Vec<RecordingRecord>, StoreError> {
    let mut page = Page { before: None, limit: PAGE };
    let mut left = Vec::new();
    loop {
        let listed = parts.catalogue.read().recordings(&page).await?;
        let is_unfinished = |record: &RecordingRecord| {
            matches!(record.state, RecordingState::Recording | RecordingState::Finishing)
        };
        left.extend(listed.records.into_iter().filter(is_unfinished));
        match listed.next {
            Some(next) => page.before = Some(next),
            None => return Ok(left),
        }
    }
}

/// Adds index and end to a truncated file if there is space for a second one; it is readable in any case.
async fn repair_and_store(parts: &RecordingParts, record: RecordingRecord, path: &Path) -> RecordingRecord {
    let free_bytes = (parts.free_bytes)();
    let draft = parts.artifacts.workbench().scratch().join(format!("{}.mcap", record.id));
    let (from, to) = (path.to_owned(), draft.clone());
    let work = move || -> Result<RecordingFigures, recording::RecordingError> {
        let size_bytes = std::fs::metadata(&from).map_or(0, |file| file.len());
        if free_bytes > size_bytes.saturating_add(FREE_FLOOR_BYTES) {
            let repaired = repair(&from, &to)?;
            tracing::info!(n_messages = repaired.n_messages, "an interrupted recording was repaired");
            std::fs::rename(&to, &from).map_err(|cause| recording::RecordingError::File {
                action: "write",
                path: from.clone(),
                cause,
            })?;
        }
        Ok(RecordingFigures::of_file(&RecordingFile::open(&from)?))
    };
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(figures)) => store_file(parts, record, path, figures, RecordingState::Interrupted).await,
        Ok(Err(error)) => {
            remove(&draft);
            mark_lost(parts, record, with_causes(&error)).await
        }
        Err(defect) => mark_lost(parts, record, defect.to_string()).await,
    }
}

async fn store_file(
    parts: &RecordingParts,
    record: RecordingRecord,
    path: &Path,
    figures: RecordingFigures,
    state: RecordingState,
) -> RecordingRecord {
    let size_bytes = std::fs::metadata(path).map_or(0, |file| file.len());
    let finishing = RecordingRecord {
        state: RecordingState::Finishing,
        size_bytes,
        summary: stored(&figures),
        ..record.clone()
    };
    if let Err(error) = parts.catalogue.commit(vec![Change::UpdateRecording(finishing)]).await {
        tracing::error!(%error, "the end of a recording is not stored");
    }
    // As a hard link: until the record refers to the artifact, the file stays where a restart looks for it.
    let second = parts.artifacts.workbench().scratch().join(format!("{}.finished.mcap", record.id));
    let named = std::fs::hard_link(path, &second).or_else(|_| std::fs::rename(path, &second));
    if let Err(cause) = named {
        return mark_lost(parts, record, cause.to_string()).await;
    }
    match parts.artifacts.adopt(FinishedFile::at(&second)).await {
        Ok(file) => {
            let record =
                RecordingRecord { state, file: Some(file), size_bytes, summary: stored(&figures), ..record };
            if commit_end(parts, &record, &figures).await {
                remove(path);
            }
            record
        }
        Err(error) => mark_lost(parts, record, with_causes(&error)).await,
    }
}

/// Nothing of it can be stored.
async fn mark_lost(parts: &RecordingParts, record: RecordingRecord, problem: String) -> RecordingRecord {
    tracing::error!(recording = record.id, problem, "a recording cannot be stored");
    let figures = RecordingFigures {
        ended: Some(Ended::Crashed),
        problem: Some(problem),
        ..serde_json::from_value(record.summary.clone()).unwrap_or_default()
    };
    let record = RecordingRecord { state: RecordingState::Failed, summary: stored(&figures), ..record };
    commit_end(parts, &record, &figures).await;
    record
}

/// Whether it was stored; if not, the next start finds the recording unchanged.
async fn commit_end(parts: &RecordingParts, record: &RecordingRecord, figures: &RecordingFigures) -> bool {
    let ended = figures.ended.unwrap_or(Ended::Crashed);
    let body = RecordingEnded {
        name: record.name.clone(),
        state: code(record.state),
        ended: code(ended),
        n_frames: figures.n_frames,
        n_lost: figures.lost.total(),
        size_bytes: record.size_bytes,
    };
    let changes = vec![Change::UpdateRecording(record.clone()), event(&record.id, Event::RecordingEnded(body))];
    let stored = parts.catalogue.commit(changes).await;
    if let Err(error) = &stored {
        tracing::error!(recording = record.id, %error, "the end of a recording is not stored");
    }
    stored.is_ok()
}
