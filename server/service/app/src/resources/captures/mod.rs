//! Captures: archives in the store, folders for the core.
//!
//! An uploaded archive is unpacked within all limits and fully validated before it is stored. The folders are a cache:
//! they are unpacked again from the archives when missing.

mod cache;
mod check;
mod entry_name;
pub mod limits;
mod pack;
mod stage;
mod tar_archive;
mod unpack;
mod zip_archive;

#[cfg(test)]
mod tests;

use parking_lot::{Mutex, MutexGuard};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use capture::Capture;
use station::wall_clock::now_ms;
use store::{ArtifactId, Artifacts, CaptureRecord, Change, FinishedFile, StoreError};
use tokio::runtime::Handle;

use crate::error::AppError;
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::captures::cache::{Cache, InUse};
use crate::resources::captures::limits::CACHE_LIMIT_BYTES;

pub use check::without_folder;
pub use stage::{capture_stage, nominal_position};

/// Archive format of a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ArchiveFormat {
    /// `application/zip`.
    Zip,
    /// `application/x-tar`.
    Tar,
}

impl ArchiveFormat {
    /// The code stored in records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zip => "zip",
            Self::Tar => "tar",
        }
    }

    fn of(record: &CaptureRecord) -> Self {
        if record.archive_format == Self::Tar.name() { Self::Tar } else { Self::Zip }
    }
}

/// Origin of a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CaptureOrigin {
    /// Uploaded by a client.
    Upload,
    /// Captured for a calibration.
    Calibration,
    /// The frames of a scan.
    Scan,
}

impl CaptureOrigin {
    /// The code stored in records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Upload => "upload",
            Self::Calibration => "calibration",
            Self::Scan => "scan",
        }
    }
}

/// Stores captures and provides them as folders.
#[derive(Clone)]
pub struct Captures {
    catalogue: EventedCatalogue,
    artifacts: Arc<dyn Artifacts>,
    runtime: Handle,
    cache: Cache,
    /// One archive is unpacked at a time: disk and memory are bounded for the whole service.
    turn: Arc<Mutex<()>>,
}

/// A capture as a folder, valid until dropped.
pub struct CheckedOut {
    /// The folder that holds `capture.json`.
    pub folder: PathBuf,
    _in_use: InUse,
}

impl Captures {
    /// Over the store, with unpacked captures in `cache`, a folder of this service alone that is emptied here.
    /// Called within the runtime.
    ///
    /// # Errors
    /// If the folder cannot be created or emptied.
    pub fn new(catalogue: EventedCatalogue, artifacts: Arc<dyn Artifacts>, cache: &Path) -> std::io::Result<Self> {
        let cache = Cache::new(cache, CACHE_LIMIT_BYTES)?;
        Ok(Self { catalogue, artifacts, runtime: Handle::current(), cache, turn: Arc::default() })
    }

    /// Unpacks `archive` (a file under the artifacts' scratch folder) within all limits, checks the capture with every
    /// image in it, stores the archive, and returns the change that records it. Blocks; leaves nothing on failure.
    pub fn take_in(
        &self,
        archive: &Path,
        format: ArchiveFormat,
        origin: CaptureOrigin,
        name: &str,
    ) -> Result<(CaptureRecord, Change), AppError> {
        let archive = RemovedAtEnd(archive.to_owned());
        let _turn = self.turn();
        let draft = RemovedAtEnd(self.cache.draft());
        let unpacked_bytes = unpack::unpack(&archive.0, format, &draft.0)?;
        let capture = check::checked_capture(&check::capture_root(&draft.0)?)?;
        let summary = check::summary(&capture, unpacked_bytes);
        let record = self.keep(&archive.0, format, origin, name, summary)?;
        // Cached for the next use; otherwise it is unpacked again.
        if let Err(error) = self.cache.put(record.archive.as_str(), &draft.0, unpacked_bytes) {
            tracing::warn!(%error, "an unpacked capture cannot be cached");
        }
        Ok((record.clone(), Change::InsertCapture(record)))
    }

    /// Packs a capture folder of this process and stores it. Blocks.
    pub fn take_in_folder(
        &self,
        folder: &Path,
        origin: CaptureOrigin,
        name: &str,
    ) -> Result<(CaptureRecord, Change), AppError> {
        let capture = Capture::open(folder).map_err(|error| without_folder(error.into(), folder))?;
        let archive =
            RemovedAtEnd(self.artifacts.workbench().scratch().join(format!("{}.tar", uuid::Uuid::now_v7())));
        pack::pack(&capture, &archive.0)?;
        let unpacked_bytes = std::fs::metadata(&archive.0).map_or(0, |metadata| metadata.len());
        let summary = check::summary(&capture, unpacked_bytes);
        let record = self.keep(&archive.0, ArchiveFormat::Tar, origin, name, summary)?;
        Ok((record.clone(), Change::InsertCapture(record)))
    }

    /// The capture as a folder; unpacked again if missing. Blocks.
    pub fn check_out(&self, capture_id: &str) -> Result<CheckedOut, AppError> {
        let record = self.runtime.block_on(self.catalogue.read().capture(capture_id))?;
        let key = record.archive.as_str();
        if let Some(found) = self.cache.get(key) {
            return checked_out(found);
        }
        let _turn = self.turn();
        // Another thread may have unpacked it in the meantime.
        if let Some(found) = self.cache.get(key) {
            return checked_out(found);
        }
        let archive =
            RemovedAtEnd(self.artifacts.workbench().scratch().join(format!("{}.archive", uuid::Uuid::now_v7())));
        self.runtime.block_on(copy(&*self.artifacts, &record.archive, &archive.0))?;
        let draft = RemovedAtEnd(self.cache.draft());
        let unpacked_bytes = unpack::unpack(&archive.0, ArchiveFormat::of(&record), &draft.0)?;
        checked_out(self.cache.put(key, &draft.0, unpacked_bytes).map_err(|cause| unpack::unwritable(&cause))?)
    }

    /// Removes unpacked captures that are not in `named` and not in use.
    pub fn evict_others(&self, named: &HashSet<ArtifactId>) {
        self.cache.retain(|key| ArtifactId::parse(key).is_some_and(|id| named.contains(&id)));
    }

    fn keep(
        &self,
        archive: &Path,
        format: ArchiveFormat,
        origin: CaptureOrigin,
        name: &str,
        summary: serde_json::Value,
    ) -> Result<CaptureRecord, AppError> {
        let size_bytes = std::fs::metadata(archive).map_err(|cause| unpack::unwritable(&cause))?.len();
        Ok(CaptureRecord {
            id: uuid::Uuid::now_v7().to_string(),
            name: name.to_owned(),
            origin: origin.name().to_owned(),
            archive: self.runtime.block_on(self.artifacts.adopt(FinishedFile::at(archive)))?,
            archive_format: format.name().to_owned(),
            size_bytes,
            summary,
            created_at_ms: now_ms(),
        })
    }

    fn turn(&self) -> MutexGuard<'_, ()> {
        self.turn.lock()
    }
}

fn checked_out((folder, in_use): (PathBuf, InUse)) -> Result<CheckedOut, AppError> {
    Ok(CheckedOut { folder: check::capture_root(&folder)?, _in_use: in_use })
}

/// Copies an artifact into a file, checking its hash.
async fn copy(artifacts: &dyn Artifacts, id: &ArtifactId, target: &Path) -> Result<(), AppError> {
    let mut reader = artifacts.open(id).await?;
    let mut file = tokio::fs::File::create_new(target).await.map_err(|cause| unpack::unwritable(&cause))?;
    match tokio::io::copy(&mut reader.bytes, &mut file).await {
        Ok(n_bytes) if n_bytes == reader.size_bytes => {}
        Err(cause) if cause.kind() == std::io::ErrorKind::StorageFull => return Err(unpack::unwritable(&cause)),
        _ => return Err(StoreError::Damaged { id: id.as_str().to_owned() }.into()),
    }
    file.sync_data().await.map_err(|cause| unpack::unwritable(&cause))
}

/// Bytes free under `folder`, as far as the system reports it.
pub fn free_bytes(folder: &Path) -> u64 {
    match nix::sys::statvfs::statvfs(folder) {
        Ok(disk) => disk.blocks_available().saturating_mul(disk.fragment_size()),
        Err(_) => u64::MAX,
    }
}

/// A temporary file or folder, removed on drop unless it was moved away.
struct RemovedAtEnd(PathBuf);

impl Drop for RemovedAtEnd {
    fn drop(&mut self) {
        let removed =
            if self.0.is_dir() { std::fs::remove_dir_all(&self.0) } else { std::fs::remove_file(&self.0) };
        if let Err(error) = removed
            && error.kind() != std::io::ErrorKind::NotFound
        {
            tracing::warn!(%error, "a temporary file of a capture cannot be removed");
        }
    }
}
