//! Deletion of unreferenced artifacts.

use std::collections::HashSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::artifacts::ArtifactId;
use crate::error::StoreError;
use crate::local::file_error;
use crate::local::place::Place;

/// Deletes artifacts that are neither kept nor held; returns the bytes freed. A deletion that is not
/// durable is harmless: the next sweep repeats it.
pub fn sweep(place: &Place, kept: &HashSet<ArtifactId>) -> Result<u64, StoreError> {
    place.check_writable()?;
    let mut freed_bytes = 0;
    for outer in entries(place.root())? {
        for inner in folder_entries(&outer)? {
            for file in folder_entries(&inner)? {
                freed_bytes += delete_unless_needed(place, kept, &file)?;
            }
        }
    }
    Ok(freed_bytes)
}

fn delete_unless_needed(place: &Place, kept: &HashSet<ArtifactId>, file: &Path) -> Result<u64, StoreError> {
    let name = file.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let Some(id) = ArtifactId::parse(name).filter(|id| !kept.contains(id)) else {
        return Ok(0);
    };
    let size_bytes = fs::metadata(file).map_or(0, |there| there.len());
    // It cannot be held until it is deleted, so that no task relies on it meanwhile.
    match place.holds().unless_held(&id, || fs::remove_file(file)) {
        Some(Ok(())) => Ok(size_bytes),
        Some(Err(cause)) if cause.kind() != io::ErrorKind::NotFound => Err(file_error("delete", file, cause)),
        None | Some(Err(_)) => Ok(0),
    }
}

/// Moves artifacts that are not kept to the new folder `target`; returns how many.
pub fn set_aside(place: &Place, kept: &HashSet<ArtifactId>, target: &Path) -> Result<usize, StoreError> {
    let mut n_moved = 0;
    for outer in entries(place.root())? {
        for inner in folder_entries(&outer)? {
            for file in folder_entries(&inner)? {
                let name = file.file_name().and_then(|name| name.to_str()).unwrap_or_default();
                if ArtifactId::parse(name).is_none_or(|id| kept.contains(&id)) {
                    continue;
                }
                let moved = fs::create_dir_all(target).and_then(|()| fs::rename(&file, target.join(name)));
                moved.map_err(|cause| file_error("set aside", &file, cause))?;
                n_moved += 1;
            }
        }
    }
    Ok(n_moved)
}

/// Whether any artifact exists.
pub fn is_empty(place: &Place) -> Result<bool, StoreError> {
    for outer in entries(place.root())? {
        for inner in folder_entries(&outer)? {
            if !folder_entries(&inner)?.is_empty() {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// The entries of a folder; empty if it does not exist.
fn folder_entries(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    if folder.is_dir() { entries(folder) } else { Ok(Vec::new()) }
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let cannot = |cause| file_error("list", folder, cause);
    let entries = fs::read_dir(folder).map_err(cannot)?;
    entries.map(|entry| Ok(entry.map_err(cannot)?.path())).collect()
}
