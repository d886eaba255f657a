//! Paths of artifacts, and durable moves of finished files to them.

use parking_lot::Mutex;
use std::collections::HashSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::artifacts::ArtifactId;
use crate::error::StoreError;
use crate::files::disk::{Disk, is_full};
use crate::health::Health;
use crate::holds::Holds;
use crate::local::file_error;

/// The folders of the artifacts.
pub struct Place {
    root: PathBuf,
    scratch: PathBuf,
    disk: Arc<dyn Disk>,
    health: Arc<Health>,
    /// Stored by this process and not referenced yet: their record may be about to be committed.
    holds: Arc<Holds>,
    /// Folders whose directory entries are known to be durable; at most 256 · 257.
    durable_folders: Mutex<HashSet<PathBuf>>,
}

impl Place {
    /// With existing folders.
    pub fn new(
        root: PathBuf,
        scratch: PathBuf,
        disk: Arc<dyn Disk>,
        health: Arc<Health>,
        holds: Arc<Holds>,
    ) -> Self {
        Self { root, scratch, disk, health, holds, durable_folders: Mutex::default() }
    }

    /// All artifacts.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The folder for unfinished files.
    pub fn scratch(&self) -> &Path {
        &self.scratch
    }

    /// The disk they are on.
    pub fn disk(&self) -> &dyn Disk {
        &*self.disk
    }

    /// Fails if a write failed before.
    pub fn check_writable(&self) -> Result<(), StoreError> {
        self.health.check()
    }

    /// The file of an artifact.
    pub fn file(&self, id: &ArtifactId) -> PathBuf {
        let name = id.as_str();
        self.root.join(&name[..2]).join(&name[2..4]).join(name)
    }

    /// Artifacts that a sweep must keep.
    pub fn holds(&self) -> &Holds {
        &self.holds
    }

    /// A new file under `scratch`.
    pub fn new_scratch_file(&self) -> Result<(File, PathBuf), StoreError> {
        self.check_writable()?;
        let path = self.scratch.join(uuid::Uuid::now_v7().simple().to_string());
        let file = File::create_new(&path).map_err(|cause| self.write_failed("make", &path, cause))?;
        Ok((file, path))
    }

    /// Holds the artifact; returns whether it exists with this size. If so, its directory entry is synced again: it may
    /// have just been created by another task.
    pub fn hold_existing(&self, id: &ArtifactId, size_bytes: u64) -> Result<bool, StoreError> {
        self.holds.hold(id);
        let file = self.file(id);
        if !fs::metadata(&file).is_ok_and(|there| there.is_file() && there.len() == size_bytes) {
            return Ok(false);
        }
        self.sync_folder(parent(&file))?;
        Ok(true)
    }

    /// Renames the scratch file `path` of `size_bytes`, whose hash is `id`, to its final name.
    pub fn keep(&self, file: &File, path: &Path, id: &ArtifactId, size_bytes: u64) -> Result<(), StoreError> {
        let kept = self.hold_existing(id, size_bytes).and_then(|there| match there {
            true => {
                let _ = fs::remove_file(path); // Emptied at the next start otherwise.
                Ok(())
            }
            false => self.name(file, path, id),
        });
        kept.inspect_err(|_| self.holds.release([id.clone()]))
    }

    fn name(&self, file: &File, path: &Path, id: &ArtifactId) -> Result<(), StoreError> {
        let target = self.file(id);
        self.disk.sync_file(file).map_err(|cause| self.write_failed("sync", path, cause))?;
        self.make_folders(parent(&target))?;
        self.disk.rename(path, &target).map_err(|cause| self.write_failed("rename", path, cause))?;
        self.sync_folder(parent(&target))
    }

    /// Creates `root/ab` and `root/ab/cd`, each durable in its parent before it is used.
    fn make_folders(&self, folder: &Path) -> Result<(), StoreError> {
        let mut durable = self.durable_folders.lock();
        for step in [parent(folder), folder] {
            if durable.contains(step) {
                continue;
            }
            match fs::create_dir(step) {
                Err(cause) if cause.kind() != io::ErrorKind::AlreadyExists => {
                    return Err(self.write_failed("make", step, cause));
                }
                _ => self.sync_folder(parent(step))?,
            }
            durable.insert(step.to_owned());
        }
        Ok(())
    }

    fn sync_folder(&self, folder: &Path) -> Result<(), StoreError> {
        let synced = self.disk.sync_folder(folder);
        synced.map_err(|cause| self.health.fail(format!("cannot sync {}: {cause}", folder.display())))
    }

    /// A full disk fails only this write; any other failure makes the store read-only.
    pub fn write_failed(&self, what: &'static str, path: &Path, cause: io::Error) -> StoreError {
        if is_full(&cause) {
            return StoreError::Full;
        }
        self.health.fail(format!("cannot {what} {}: {cause}", path.display()))
    }

    /// An error that does not make the store read-only.
    pub fn read_failed(&self, id: &ArtifactId, cause: io::Error) -> StoreError {
        match cause.kind() {
            io::ErrorKind::NotFound => StoreError::NotFound { kind: "artifact", id: id.as_str().to_owned() },
            _ => file_error("read", &self.file(id), cause),
        }
    }
}

fn parent(path: &Path) -> &Path {
    path.parent().expect("artifacts lie two folders below the root")
}
