//! A data directory: the catalogue, the artifacts, the lock, the reserve.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio::sync::watch;

use crate::artifacts::Artifacts;
use crate::catalogue::{Catalogue, Change, Page, StoreError};
use crate::disk::{Disk, LocalDisk};
use crate::health::Health;
use crate::local::LocalArtifacts;
use crate::params::{BACKUPS_FOLDER, CATALOGUE_FILE, LOCK_FILE, RESERVE_BYTES, RESERVE_FILE};
use crate::records::{EventRecord, JobOutcome, JobRecord, JobState};
use crate::sqlite::SqliteCatalogue;

/// An open data directory.
pub struct Store {
    /// The records.
    pub catalogue: Arc<dyn Catalogue>,
    /// The files they name.
    pub artifacts: Arc<dyn Artifacts>,
    folder: PathBuf,
    health: Arc<Health>,
    sqlite: SqliteCatalogue,
    /// Released with the process, however it ends.
    _lock: File,
}

impl Store {
    /// Opens the data directory `folder`, made or migrated if need be.
    ///
    /// # Errors
    /// [`StoreError::InUse`], [`StoreError::TooNew`], or what the disk or the database says.
    pub async fn open(folder: &Path) -> Result<Self, StoreError> {
        Self::open_on(folder, Arc::new(LocalDisk)).await
    }

    /// The same with another disk below the artifacts.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub async fn open_on(folder: &Path, disk: Arc<dyn Disk>) -> Result<Self, StoreError> {
        let lock = prepare(folder)?;
        let health = Arc::new(Health::default());
        let artifacts = LocalArtifacts::open(folder, disk, health.clone())?;
        let sqlite = open_catalogue(folder, &health).await?;
        LocalDisk.sync_folder(folder).map_err(|cause| file_error("sync", folder, cause))?;
        let store = Self {
            catalogue: Arc::new(sqlite.clone()),
            artifacts: Arc::new(artifacts),
            folder: folder.to_owned(),
            health,
            sqlite,
            _lock: lock,
        };
        store.fill_reserve();
        Ok(store)
    }

    /// Whether a write failed, so that nothing is written any more.
    pub fn is_read_only(&self) -> bool {
        self.health.is_read_only()
    }

    /// Sees why the store became read-only as soon as it does.
    pub fn watch_failure(&self) -> watch::Receiver<Option<String>> {
        self.health.watch()
    }

    /// Bytes that are free for this process on the disk of the data directory.
    ///
    /// # Errors
    /// [`StoreError::File`] if the disk does not tell.
    pub fn free_bytes(&self) -> Result<u64, StoreError> {
        let disk = nix::sys::statvfs::statvfs(&self.folder)
            .map_err(|errno| file_error("ask for free space in", &self.folder, errno.into()))?;
        Ok(disk.blocks_available() * disk.fragment_size())
    }

    /// Ends what a dead process left running: each such job is interrupted, with an event. Called before anybody
    /// can see the jobs; queued ones stay queued. Returns the events.
    ///
    /// # Errors
    /// What [`Catalogue::commit`] says.
    pub async fn recover(&self, now_ms: i64) -> Result<Vec<EventRecord>, StoreError> {
        let page = Page { before: None, limit: u32::MAX };
        let running = self.catalogue.jobs(Some(JobState::Running), &page).await?;
        for row in &running.damaged {
            tracing::error!(kind = row.kind, id = row.id, "a damaged record is left as it is");
        }
        let changes = running.records.iter().flat_map(|job| interruption(job, now_ms)).collect();
        self.catalogue.commit(changes).await
    }

    /// Deletes artifacts that no record names, then fills the reserve again if there is room. Returns how many bytes
    /// became free.
    ///
    /// # Errors
    /// What the catalogue or the disk says.
    pub async fn sweep_unreferenced(&self) -> Result<u64, StoreError> {
        let named = self.catalogue.artifacts_named().await?;
        let freed_bytes = self.artifacts.sweep(&named).await?;
        self.fill_reserve();
        Ok(freed_bytes)
    }

    /// Gives the reserve back to the disk, so that records can be deleted although it is full.
    ///
    /// # Errors
    /// [`StoreError::File`] if the file cannot be deleted.
    pub fn release_reserve(&self) -> Result<(), StoreError> {
        release_reserve(&self.folder)
    }

    /// Copies the catalogue, as it is now, to the new file `target`.
    ///
    /// # Errors
    /// [`StoreError::Full`], [`StoreError::Database`] if the file is there already.
    pub async fn copy_catalogue(&self, target: &Path) -> Result<(), StoreError> {
        self.sqlite.copy_to(target).await
    }

    /// Closes the catalogue's readers; the rest closes when the last one who holds it lets go.
    pub async fn close(self) {
        self.sqlite.close().await;
    }

    /// Makes the reserve unless it is there, or there would be no room left beside it.
    fn fill_reserve(&self) {
        let path = self.folder.join(RESERVE_FILE);
        let there = fs::metadata(&path).is_ok_and(|file| file.len() == RESERVE_BYTES);
        let roomy = self.free_bytes().is_ok_and(|free_bytes| free_bytes > 2 * RESERVE_BYTES);
        if there || !roomy || self.is_read_only() {
            return;
        }
        if let Err(cause) = write_reserve(&path) {
            tracing::warn!(%cause, "there is no reserve for a full disk");
        }
    }
}

/// Makes the folders and takes the lock.
fn prepare(folder: &Path) -> Result<File, StoreError> {
    let backups = folder.join(BACKUPS_FOLDER);
    fs::create_dir_all(&backups).map_err(|cause| file_error("make", &backups, cause))?;
    let path = folder.join(LOCK_FILE);
    let cannot = |cause| file_error("lock", &path, cause);
    let lock = File::options().create(true).truncate(false).write(true).open(&path).map_err(cannot)?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => Err(StoreError::InUse { folder: folder.display().to_string() }),
        Err(TryLockError::Error(cause)) => Err(cannot(cause)),
    }
}

/// Even opening needs some room; on a full disk the reserve makes it.
async fn open_catalogue(folder: &Path, health: &Arc<Health>) -> Result<SqliteCatalogue, StoreError> {
    let (file, backups) = (folder.join(CATALOGUE_FILE), folder.join(BACKUPS_FOLDER));
    match SqliteCatalogue::open(&file, &backups, health.clone()).await {
        Err(StoreError::Full) => {
            release_reserve(folder)?;
            SqliteCatalogue::open(&file, &backups, health.clone()).await
        }
        opened => opened,
    }
}

fn release_reserve(folder: &Path) -> Result<(), StoreError> {
    let path = folder.join(RESERVE_FILE);
    match fs::remove_file(&path) {
        Err(cause) if cause.kind() != io::ErrorKind::NotFound => Err(file_error("delete", &path, cause)),
        _ => Ok(()),
    }
}

/// Written, not just made long: a sparse file reserves nothing.
fn write_reserve(path: &Path) -> io::Result<()> {
    let mut file = File::create(path)?;
    let filled = io::copy(&mut io::Read::take(io::repeat(0), RESERVE_BYTES), &mut file).and_then(|_| file.flush());
    filled.inspect_err(|_| drop(fs::remove_file(path)))
}

fn interruption(job: &JobRecord, now_ms: i64) -> [Change; 2] {
    let message = "interrupted: the server ended while it ran".to_owned();
    let body = serde_json::json!({ "id": job.id, "kind": job.kind, "state": "interrupted", "message": message });
    [
        Change::EndJob { id: job.id.clone(), outcome: JobOutcome::Interrupted, message, at_ms: now_ms },
        Change::AppendEvent(EventRecord {
            seq: 0,
            kind: "job.interrupted".to_owned(),
            subject: job.id.clone(),
            body,
            at_ms: now_ms,
        }),
    ]
}

fn file_error(what: &'static str, path: &Path, cause: io::Error) -> StoreError {
    StoreError::File { what, path: path.display().to_string(), cause }
}
