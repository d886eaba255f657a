//! The files of one inspection: written whole, never over another file, and only once.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;

use app::doors::Undelivered;

use crate::disk::{Disk, DiskError, check_folder, numbered, write_beside};
use crate::params::MOST_SUFFIXES;

/// A file to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Document {
    /// Its extension.
    pub extension: &'static str,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// What exists under a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Existing {
    Nothing,
    Same,
    Other,
}

/// Writes all documents durably under the same name. If files of this name exist with another content, it gets the
/// suffix `-2`, `-3`, …; documents that exist already with this content are not written again, so that a repetition
/// leaves the folder as it is.
///
/// # Errors
/// The folder does not exist, is full, read-only or disconnected: unreachable. The file system refuses the name:
/// refused.
pub fn write_all(disk: &dyn Disk, folder: &Path, stem: &str, documents: &[Document]) -> Result<(), Undelivered> {
    check_folder(folder).map_err(undelivered)?;
    for n in 1..=MOST_SUFFIXES {
        if write_numbered(disk, folder, (stem, n), documents).map_err(undelivered)? {
            return disk.sync_folder(folder).map_err(DiskError::at(folder, "sync")).map_err(undelivered);
        }
    }
    let folder = folder.display();
    Err(Undelivered::unreachable(format!(
        "{folder} has {MOST_SUFFIXES} files of the name {stem}: move them away, or add {{seq}} to file_name"
    )))
}

/// Whether all documents exist under this name now; `false` if another file has it.
fn write_numbered(
    disk: &dyn Disk,
    folder: &Path,
    (stem, n): (&str, usize),
    documents: &[Document],
) -> Result<bool, DiskError> {
    let mut missing = Vec::new();
    for document in documents {
        let name = numbered(stem, document.extension, n);
        match existing(&folder.join(&name), &document.bytes) {
            Ok(Existing::Nothing) => missing.push((name, document)),
            Ok(Existing::Same) => {}
            Ok(Existing::Other) => return Ok(false),
            Err(cause) => return Err(DiskError::at(folder, format!("compare {name}"))(cause)),
        }
    }
    for (name, document) in missing {
        let beside = write_beside(disk, folder, &name, &document.bytes)?;
        let Err(cause) = disk.rename_new(&beside, &folder.join(&name)) else { continue };
        // Best effort: the next start removes it.
        let _ = fs::remove_file(&beside);
        // Someone else wrote this name since.
        if cause.kind() == ErrorKind::AlreadyExists {
            return Ok(false);
        }
        return Err(DiskError::at(folder, format!("rename {name}"))(cause));
    }
    Ok(true)
}

fn existing(path: &Path, bytes: &[u8]) -> io::Result<Existing> {
    let metadata = match fs::symlink_metadata(path) {
        Ok(metadata) => metadata,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Existing::Nothing),
        Err(error) => return Err(error),
    };
    // A link or a folder is not ours.
    if !metadata.is_file() || metadata.len() != bytes.len() as u64 {
        return Ok(Existing::Other);
    }
    Ok(if fs::read(path)? == bytes { Existing::Same } else { Existing::Other })
}

fn undelivered(error: DiskError) -> Undelivered {
    match error.is_about_the_name() {
        true => Undelivered::Refused(error.to_string()),
        false => Undelivered::unreachable(error.to_string()),
    }
}
