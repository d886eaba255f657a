//! A data directory: the catalogue, the artifacts, the lock, the reserve.

use std::collections::HashSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use tokio::sync::{Mutex, watch};

use crate::artifacts::{ArtifactId, Artifacts};
use crate::catalogue::{Catalogue, Change, Page};
use crate::error::StoreError;
use crate::files::disk::{Disk, LocalDisk};
use crate::files::reserve::Reserve;
use crate::health::Health;
use crate::holds::Holds;
use crate::identity;
use crate::local::LocalArtifacts;
use crate::params::{BACKUP_FLOOR_BYTES, BACKUP_PERIOD, BACKUPS_FOLDER, BACKUPS_KEPT, LOCK_FILE};
use crate::records::{EventRecord, JobOutcome, JobRecord, JobState};
use crate::sqlite::SqliteCatalogue;

/// An open data directory.
pub struct Store {
    /// The records.
    pub catalogue: Arc<dyn Catalogue>,
    /// The files they refer to.
    pub artifacts: Arc<dyn Artifacts>,
    folder: PathBuf,
    health: Arc<Health>,
    holds: Arc<Holds>,
    reserve: Reserve,
    /// One sweep at a time.
    sweeping: Mutex<()>,
    sqlite: SqliteCatalogue,
    /// Released with the process, however it ends.
    _lock: File,
}

impl Store {
    /// Opens the data directory `folder`, created or migrated if necessary.
    ///
    /// # Errors
    /// [`StoreError::InUse`], [`StoreError::TooNew`], or an error of the disk or the database.
    pub async fn open(folder: &Path) -> Result<Self, StoreError> {
        Self::open_on(folder, Arc::new(LocalDisk)).await
    }

    /// The same with another disk below the artifacts.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub async fn open_on(folder: &Path, disk: Arc<dyn Disk>) -> Result<Self, StoreError> {
        let lock = prepare(folder)?;
        let (health, holds) = (Arc::new(Health::default()), Arc::new(Holds::default()));
        let artifacts = LocalArtifacts::open(folder, disk, health.clone(), holds.clone())?;
        identity::check_before_opening(folder, &artifacts)?;
        let reserve = Reserve::new(folder);
        let open = || SqliteCatalogue::open(folder, health.clone(), holds.clone(), reserve.clone());
        let sqlite = match open().await {
            // Even opening needs some disk space; on a full disk the reserve is released.
            Err(StoreError::Full) => {
                reserve.release()?;
                open().await?
            }
            opened => opened?,
        };
        identity::check(folder, &sqlite, &artifacts).await?;
        LocalDisk.sync_folder(folder).map_err(|cause| file_error("sync", folder, cause))?;
        let store = Self {
            catalogue: Arc::new(sqlite.clone()),
            artifacts: Arc::new(artifacts),
            folder: folder.to_owned(),
            health,
            holds,
            reserve,
            sweeping: Mutex::default(),
            sqlite,
            _lock: lock,
        };
        store.fill_reserve();
        Ok(store)
    }

    /// Whether a write failed and the store is therefore read-only.
    pub fn is_read_only(&self) -> bool {
        self.health.is_read_only()
    }

    /// A receiver that gets the reason when the store becomes read-only.
    pub fn watch_failure(&self) -> watch::Receiver<Option<String>> {
        self.health.watch()
    }

    /// Bytes that are free for this process on the disk of the data directory.
    ///
    /// # Errors
    /// [`StoreError::File`] if the disk does not report it.
    pub fn free_bytes(&self) -> Result<u64, StoreError> {
        let disk = nix::sys::statvfs::statvfs(&self.folder)
            .map_err(|errno| file_error("ask for free space in", &self.folder, errno.into()))?;
        Ok(disk.blocks_available() * disk.fragment_size())
    }

    /// Marks jobs left running by a crashed process as interrupted, with an event each. Called before any client
    /// can read the jobs; queued ones stay queued. Returns the events.
    ///
    /// # Errors
    /// As [`Catalogue::commit`].
    pub async fn recover(&self, now_ms: i64) -> Result<Vec<EventRecord>, StoreError> {
        let page = Page { before: None, limit: u32::MAX };
        let running = self.catalogue.jobs(Some(JobState::Running), &page).await?;
        for row in &running.damaged {
            tracing::error!(kind = row.kind, id = row.id, "a damaged record is left as it is");
        }
        let changes = running.records.iter().flat_map(|job| interruption(job, now_ms)).collect();
        self.catalogue.commit(changes).await
    }

    /// Deletes artifacts that no record refers to, then restores the reserve if there is space. Returns how many bytes
    /// were freed. `also_named` returns, given those that records refer to, the artifacts referenced elsewhere: by
    /// caches, which drop the rest.
    ///
    /// Artifacts stored, read or committed meanwhile are kept. While a record is damaged nothing is deleted.
    ///
    /// # Errors
    /// An error of the catalogue or the disk.
    pub async fn sweep_unreferenced(
        &self,
        also_named: impl FnOnce(&HashSet<ArtifactId>) -> HashSet<ArtifactId>,
    ) -> Result<u64, StoreError> {
        let _turn = self.sweeping.lock().await;
        let swept = {
            // Before the catalogue is read: references added later are held until the end.
            let _sweep = self.holds.begin_sweep();
            if let Err(error) = identity::note_progress(&self.folder, &*self.catalogue).await {
                // On a full disk the deletions matter more.
                tracing::warn!(%error, "the progress of the catalogue could not be stored");
            }
            let mut named = self.catalogue.artifacts_named().await?;
            named.extend(also_named(&named));
            self.artifacts.sweep(&named).await
        };
        self.fill_reserve();
        swept
    }

    /// Copies the catalogue to the folder of backups, unless the newest copy there is younger than a day or the disk is
    /// nearly full; the newest copies stay, and those made before migrations.
    ///
    /// # Errors
    /// An error of the database or the disk.
    pub async fn back_up(&self) -> Result<(), StoreError> {
        let age = identity::newest_backup(&self.folder).and_then(|file| fs::metadata(file).ok()?.modified().ok());
        let is_young = age.is_some_and(|at| at.elapsed().is_ok_and(|age| age < BACKUP_PERIOD));
        if is_young || self.free_bytes()? < BACKUP_FLOOR_BYTES {
            return Ok(());
        }
        let backups = self.folder.join(BACKUPS_FOLDER);
        let draft = backups.join("copy.part");
        // An incomplete copy left by a crashed process.
        let _ = fs::remove_file(&draft);
        let copied = SqliteCatalogue::copy_file(&self.folder, &draft).await;
        copied.inspect_err(|_| drop(fs::remove_file(&draft)))?;
        identity::count_copy(&self.folder, &*self.catalogue).await?;
        let now_ms = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_millis());
        let target = backups.join(format!("{DAILY}{now_ms:013}.sqlite3"));
        let named = fs::rename(&draft, &target).and_then(|()| LocalDisk.sync_folder(&backups));
        named.map_err(|cause| file_error("name", &target, cause))?;
        prune_backups(&backups).map_err(|cause| file_error("delete old copies in", &backups, cause))
    }

    /// Releases the reserve, so that records can be deleted on a full disk.
    ///
    /// # Errors
    /// [`StoreError::File`] if the file cannot be deleted.
    pub fn release_reserve(&self) -> Result<(), StoreError> {
        self.reserve.release()
    }

    /// Copies the catalogue, as it is now, to the new file `target`.
    ///
    /// # Errors
    /// [`StoreError::Full`], [`StoreError::Database`] if the file exists.
    pub async fn copy_catalogue(&self, target: &Path) -> Result<(), StoreError> {
        self.sqlite.copy_to(target).await
    }

    /// Restores the reserve if there is space for it.
    fn fill_reserve(&self) {
        if !self.is_read_only() {
            self.reserve.fill(self.free_bytes().unwrap_or(0));
        }
    }

    /// Closes the catalogue's readers; the rest closes when the last clone is dropped.
    pub async fn close(self) {
        self.sqlite.close().await;
    }
}

/// Prefix of the name of a daily copy; a number follows that sorts by age.
const DAILY: &str = "catalogue-daily-";

fn prune_backups(folder: &Path) -> io::Result<()> {
    let mut daily: Vec<PathBuf> = fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    daily.retain(|file| file.file_name().is_some_and(|name| name.to_string_lossy().starts_with(DAILY)));
    daily.sort();
    let n_old = daily.len().saturating_sub(BACKUPS_KEPT);
    daily[..n_old].iter().try_for_each(fs::remove_file)
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

fn interruption(job: &JobRecord, now_ms: i64) -> [Change; 2] {
    let message = "interrupted: the server ended while it was running".to_owned();
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
