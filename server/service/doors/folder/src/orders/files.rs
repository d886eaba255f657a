//! The files in the folder of orders: found, read and moved. Links are never followed.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use nix::fcntl::OFlag;

use crate::disk::{Disk, DiskError, check_folder, numbered, probe, write_beside};
use crate::orders::order::{OrderFormat, Refusal};
use crate::params::{LARGEST_ORDER_BYTES, MOST_SUFFIXES};

/// Folder for files whose orders were all accepted.
pub const ACCEPTED: &str = "accepted";

/// Folder for all others.
pub const REFUSED: &str = "refused";

/// What changes when a file is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    /// Size.
    pub size_bytes: u64,
    /// When it was changed; not all network shares say so.
    pub changed_at: Option<SystemTime>,
}

/// A file with orders.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its path.
    pub path: PathBuf,
    /// Its name.
    pub name: String,
    /// Its format, by extension.
    pub format: OrderFormat,
    /// Whether it is a file and not a link to one.
    pub is_file: bool,
    /// Its state.
    pub stamp: Stamp,
}

/// The files with orders, oldest first.
///
/// # Errors
/// The folder cannot be read.
pub fn found(folder: &Path) -> Result<Vec<Found>, DiskError> {
    check_folder(folder)?;
    let mut all = Vec::new();
    let mut list = || {
        for entry in fs::read_dir(folder)? {
            all.extend(of_entry(&entry?.path())?);
        }
        Ok(())
    };
    list().map_err(DiskError::at(folder, "list the orders"))?;
    all.sort_by(|one, other| (one.stamp.changed_at, &one.name).cmp(&(other.stamp.changed_at, &other.name)));
    Ok(all)
}

fn of_entry(path: &Path) -> io::Result<Option<Found>> {
    let Some(name) = path.file_name().map(|name| name.to_string_lossy().into_owned()) else { return Ok(None) };
    // Hidden files and the lock files of spreadsheets are not meant for anyone.
    if name.starts_with(['.', '~']) {
        return Ok(None);
    }
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    let format = match extension.as_deref() {
        Some("json") => OrderFormat::Json,
        Some("csv") => OrderFormat::Csv,
        _ => return Ok(None),
    };
    let metadata = match fs::symlink_metadata(path) {
        Ok(metadata) => metadata,
        // Somebody has taken it away.
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    let kind = metadata.file_type();
    let is_order = kind.is_file() || kind.is_symlink();
    let stamp = stamp(&metadata);
    Ok(is_order.then(|| Found { path: path.to_owned(), name, format, is_file: kind.is_file(), stamp }))
}

fn stamp(metadata: &Metadata) -> Stamp {
    Stamp { size_bytes: metadata.len(), changed_at: metadata.modified().ok() }
}

/// The content of a file; `None` if it has changed since it was found.
///
/// # Errors
/// It cannot be read.
pub fn read(file: &Found) -> Result<Option<Result<Vec<u8>, Refusal>>, DiskError> {
    if !file.is_file {
        let refusal = Refusal::new("the file is a link", "put the file itself into the folder");
        return Ok(Some(Err(refusal)));
    }
    let folder = file.path.parent().unwrap_or(&file.path);
    let opened = || -> io::Result<_> {
        let file = open(&file.path)?;
        let metadata = file.metadata()?;
        let mut bytes = Vec::new();
        (&file).take(LARGEST_ORDER_BYTES + 1).read_to_end(&mut bytes)?;
        Ok((metadata, bytes))
    };
    let (metadata, bytes) = match opened() {
        Ok(read) => read,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(cause) => return Err(DiskError::at(folder, format!("read {}", file.name))(cause)),
    };
    let n_bytes = bytes.len() as u64;
    if n_bytes > LARGEST_ORDER_BYTES {
        let remedy = format!("give at most {LARGEST_ORDER_BYTES} bytes: split the table");
        let refusal = Refusal::new("the file is too large", remedy);
        return Ok(Some(Err(refusal)));
    }
    let is_whole = metadata.is_file() && stamp(&metadata) == file.stamp && n_bytes == file.stamp.size_bytes;
    Ok(is_whole.then_some(Ok(bytes)))
}

/// Neither follows a link nor waits for the writer of a pipe that was put in place of the file.
fn open(path: &Path) -> io::Result<File> {
    let flags = OFlag::O_NOFOLLOW | OFlag::O_NONBLOCK;
    OpenOptions::new().read(true).custom_flags(flags.bits()).open(path)
}

/// Makes sure that a file could be moved to `accepted` now: otherwise its orders would be accepted, and it would remain.
///
/// # Errors
/// It could not.
pub fn check_movable(disk: &dyn Disk, folder: &Path) -> Result<(), DiskError> {
    probe(disk, folder)?;
    probe(disk, &subfolder(folder, ACCEPTED)?)
}

/// Moves a file to `accepted`, durably; `false` if it has changed since and therefore stays.
///
/// # Errors
/// It cannot be moved.
pub fn accept(disk: &dyn Disk, folder: &Path, file: &Found) -> Result<bool, DiskError> {
    let target = subfolder(folder, ACCEPTED)?;
    move_into(disk, folder, &target, file, None)
}

/// Moves a file to `refused`, durably, with a text that says why; `false` if it has changed since and therefore stays.
///
/// # Errors
/// It cannot be moved.
pub fn refuse(disk: &dyn Disk, folder: &Path, file: &Found, why: &str) -> Result<bool, DiskError> {
    let target = subfolder(folder, REFUSED)?;
    move_into(disk, folder, &target, file, Some(why))
}

fn move_into(
    disk: &dyn Disk,
    folder: &Path,
    target: &Path,
    file: &Found,
    why: Option<&str>,
) -> Result<bool, DiskError> {
    let (stem, extension) = file.name.rsplit_once('.').unwrap_or((&file.name, ""));
    for n in 1..=MOST_SUFFIXES {
        let name = numbered(stem, extension, n);
        let (to, note) = (target.join(&name), format!("{name}.txt"));
        let is_noted = why.map(|why| is_written(&target.join(&note), why)).transpose();
        let is_noted = is_noted.map_err(DiskError::at(target, format!("compare {note}")))?;
        if is_taken(&to) || is_noted == Some(Written::Otherwise) {
            continue;
        }
        if !is_unchanged(file) {
            return Ok(false);
        }
        // First the text: a refused file is never without one. After a crash in between it is found as it is.
        if let (Some(why), Some(Written::No)) = (why, is_noted) {
            let beside = write_beside(disk, target, &note, why.as_bytes())?;
            disk.rename_new(&beside, &target.join(&note))
                .map_err(DiskError::at(target, format!("write {note}")))?;
        }
        match disk.rename_new(&file.path, &to) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
            Err(cause) => return Err(DiskError::at(target, format!("move {}", file.name))(cause)),
        }
        disk.sync_folder(target).map_err(DiskError::at(target, "sync"))?;
        disk.sync_folder(folder).map_err(DiskError::at(folder, "sync"))?;
        return Ok(true);
    }
    let full = io::Error::other(format!("{MOST_SUFFIXES} files of this name exist; move them away"));
    Err(DiskError::at(target, format!("move {}", file.name))(full))
}

/// Whether a text exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Written {
    No,
    Yes,
    Otherwise,
}

fn is_written(path: &Path, text: &str) -> io::Result<Written> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_file() => {
            Ok(if fs::read(path)? == text.as_bytes() { Written::Yes } else { Written::Otherwise })
        }
        Ok(_) => Ok(Written::Otherwise),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Written::No),
        Err(error) => Err(error),
    }
}

fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

fn is_unchanged(file: &Found) -> bool {
    fs::symlink_metadata(&file.path).is_ok_and(|metadata| stamp(&metadata) == file.stamp)
}

/// A folder below that of the orders, created if necessary; never a link to another place.
fn subfolder(folder: &Path, name: &str) -> Result<PathBuf, DiskError> {
    let path = folder.join(name);
    let is_folder = match fs::symlink_metadata(&path) {
        Ok(metadata) if metadata.is_dir() => Ok(()),
        Ok(_) => Err(io::Error::new(ErrorKind::NotADirectory, "not a folder")),
        Err(error) if error.kind() == ErrorKind::NotFound => fs::create_dir(&path),
        Err(error) => Err(error),
    };
    is_folder.map_err(DiskError::at(&path, format!("create the folder {name}")))?;
    Ok(path)
}
