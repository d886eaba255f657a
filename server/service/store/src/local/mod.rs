//! Artifacts as local files: `artifacts/ab/cd/abcd…`, written in `scratch` and renamed into place.

mod place;
mod reader;
mod sweep;
mod writer;

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use async_trait::async_trait;

use crate::artifacts::{ArtifactId, ArtifactReader, ArtifactWriter, Artifacts};
use crate::error::StoreError;
use crate::files::bytes::ArtifactBytes;
use crate::files::disk::Disk;
use crate::files::workbench::{FinishedFile, Workbench};
use crate::health::Health;
use crate::holds::Holds;
use crate::local::place::Place;
use crate::local::writer::LocalWriter;
use crate::params::{ARTIFACTS_FOLDER, SCRATCH_FOLDER};

/// Artifacts in the folders `artifacts` and `scratch` of a data directory.
#[derive(Clone)]
pub struct LocalArtifacts {
    place: Arc<Place>,
    workbench: Arc<Workbench>,
}

impl LocalArtifacts {
    /// Opens the folders, creating them if necessary and emptying `scratch`. Blocks.
    ///
    /// # Errors
    /// [`StoreError::File`] if a folder cannot be created or emptied.
    pub(crate) fn open(
        folder: &Path,
        disk: Arc<dyn Disk>,
        health: Arc<Health>,
        holds: Arc<Holds>,
    ) -> Result<Self, StoreError> {
        let scratch = folder.join(SCRATCH_FOLDER);
        empty(&scratch).map_err(|cause| file_error("empty", &scratch, cause))?;
        let root = folder.join(ARTIFACTS_FOLDER);
        std::fs::create_dir_all(&root).map_err(|cause| file_error("make", &root, cause))?;
        disk.sync_folder(folder).map_err(|cause| file_error("sync", folder, cause))?;
        let workbench = Arc::new(Workbench::new(folder.to_owned(), scratch.clone()));
        Ok(Self { place: Arc::new(Place::new(root, scratch, disk, health, holds)), workbench })
    }

    /// Whether the artifact exists; its hash is not verified.
    pub(crate) fn has(&self, id: &ArtifactId) -> bool {
        self.place.file(id).is_file()
    }

    /// Moves artifacts that are not `kept` to the new folder `target`; returns their number. Blocks.
    pub(crate) fn set_aside(&self, kept: &HashSet<ArtifactId>, target: &Path) -> Result<usize, StoreError> {
        sweep::set_aside(&self.place, kept, target)
    }

    /// Whether there are no artifacts. Blocks.
    pub(crate) fn is_empty(&self) -> Result<bool, StoreError> {
        sweep::is_empty(&self.place)
    }

    /// Runs file operations on a blocking thread.
    async fn blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Arc<Place>) -> Result<T, StoreError> + Send + 'static,
    ) -> Result<T, StoreError> {
        let place = self.place.clone();
        blocking(move || work(&place)).await
    }
}

fn empty(folder: &Path) -> std::io::Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => Err(cause),
        _ => std::fs::create_dir_all(folder),
    }
}

fn file_error(what: &'static str, path: &Path, cause: std::io::Error) -> StoreError {
    StoreError::File { what, path: path.display().to_string(), cause }
}

async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, StoreError> + Send + 'static,
) -> Result<T, StoreError> {
    match tokio::task::spawn_blocking(work).await {
        Ok(result) => result,
        Err(cause) if cause.is_panic() => std::panic::resume_unwind(cause.into_panic()),
        Err(cause) => Err(StoreError::File {
            what: "work on artifacts:",
            path: "the runtime is shutting down".to_owned(),
            cause: std::io::Error::other(cause),
        }),
    }
}

#[async_trait]
impl Artifacts for LocalArtifacts {
    async fn create(&self) -> Result<Box<dyn ArtifactWriter>, StoreError> {
        Ok(Box::new(LocalWriter::create(self.place.clone()).await?))
    }

    async fn open(&self, id: &ArtifactId) -> Result<ArtifactReader, StoreError> {
        reader::open(&self.place, id).await
    }

    async fn bytes(&self, id: &ArtifactId) -> Result<ArtifactBytes, StoreError> {
        let id = id.clone();
        self.blocking(move |place| reader::bytes(place, &id)).await
    }

    async fn check(&self, id: &ArtifactId) -> Result<(), StoreError> {
        let id = id.clone();
        self.blocking(move |place| reader::check(place, &id)).await
    }

    async fn read(&self, id: &ArtifactId) -> Result<Vec<u8>, StoreError> {
        let id = id.clone();
        self.blocking(move |place| reader::read(place, &id)).await
    }

    async fn put(&self, bytes: &[u8]) -> Result<ArtifactId, StoreError> {
        let bytes = bytes.to_vec();
        self.blocking(move |place| writer::put(place, &bytes)).await
    }

    async fn adopt(&self, file: FinishedFile) -> Result<ArtifactId, StoreError> {
        self.blocking(move |place| writer::adopt(place, file.path())).await
    }

    fn workbench(&self) -> &Workbench {
        &self.workbench
    }

    async fn hold(&self, id: &ArtifactId) -> Result<(), StoreError> {
        self.place.holds().hold(id);
        if self.has(id) {
            return Ok(());
        }
        self.release(id);
        Err(StoreError::NotFound { kind: "artifact", id: id.as_str().to_owned() })
    }

    fn release(&self, id: &ArtifactId) {
        self.place.holds().release([id.clone()]);
    }

    async fn sweep(&self, kept: &HashSet<ArtifactId>) -> Result<u64, StoreError> {
        let kept = kept.clone();
        self.blocking(move |place| sweep::sweep(place, &kept)).await
    }
}
