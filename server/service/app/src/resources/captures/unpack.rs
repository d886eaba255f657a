//! Unpacks untrusted archives.
//!
//! Every byte is counted as it is written: an archive bomb is stopped at the limit, whatever its headers state.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use crate::error::{AppError, ErrorKind};
use crate::resources::captures::ArchiveFormat;
use crate::resources::captures::entry_name::Places;
use crate::resources::captures::limits::{
    ARCHIVE_LIMIT_BYTES, ENTRY_LIMIT, FILE_LIMIT_BYTES, RATIO_FREE_BYTES, RATIO_LIMIT, ROOM_LEFT_BYTES,
    UNPACKED_LIMIT_BYTES,
};
use crate::resources::captures::{tar_archive, zip_archive};

/// Bytes copied at a time.
const CHUNK_BYTES: usize = 64 << 10;

/// Folders that the Finder adds to zip files; never part of a capture.
const FINDER_FOLDER: &str = "__MACOSX/";

/// Unpacks `archive` into the new folder `target`; returns how many bytes that took.
pub(super) fn unpack(archive: &Path, format: ArchiveFormat, target: &Path) -> Result<u64, AppError> {
    let size_bytes = std::fs::metadata(archive).map_err(|cause| unreadable(&cause))?.len();
    if size_bytes > ARCHIVE_LIMIT_BYTES {
        return Err(too_large(format!("the archive has {size_bytes} bytes, the limit is {ARCHIVE_LIMIT_BYTES}")));
    }
    std::fs::create_dir(target).map_err(|cause| unwritable(&cause))?;
    let mut sink = Sink::new(target, size_bytes);
    match format {
        ArchiveFormat::Zip => zip_archive::unpack(archive, &mut sink)?,
        ArchiveFormat::Tar => tar_archive::unpack(archive, &mut sink)?,
    }
    Ok(sink.written_bytes)
}

/// The target folder, with all limits.
pub(super) struct Sink {
    folder: PathBuf,
    places: Places,
    n_entries: usize,
    written_bytes: u64,
    limit_bytes: u64,
    room_bytes: u64,
}

impl Sink {
    fn new(folder: &Path, archive_bytes: u64) -> Self {
        let by_ratio = RATIO_FREE_BYTES.max(archive_bytes.saturating_mul(RATIO_LIMIT));
        Self {
            folder: folder.to_owned(),
            places: Places::default(),
            n_entries: 0,
            written_bytes: 0,
            limit_bytes: by_ratio.min(UNPACKED_LIMIT_BYTES),
            room_bytes: super::free_bytes(folder).saturating_sub(ROOM_LEFT_BYTES),
        }
    }

    /// Counts an entry of any kind.
    pub fn count(&mut self) -> Result<(), AppError> {
        self.n_entries += 1;
        if self.n_entries > ENTRY_LIMIT { Err(too_many_entries()) } else { Ok(()) }
    }

    /// Creates a folder.
    pub fn folder(&mut self, name: &str) -> Result<(), AppError> {
        if name.starts_with(FINDER_FOLDER) {
            return Ok(());
        }
        let path = self.places.folder(name)?;
        std::fs::create_dir_all(self.folder.join(path)).map_err(|cause| unwritable(&cause))
    }

    /// Writes a file.
    pub fn file(&mut self, name: &str, content: &mut dyn Read) -> Result<(), AppError> {
        if name.starts_with(FINDER_FOLDER) {
            return Ok(());
        }
        let path = self.folder.join(self.places.file(name)?);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(|cause| unwritable(&cause))?;
        }
        let mut file = File::create_new(&path).map_err(|cause| unwritable(&cause))?;
        let mut chunk = vec![0; CHUNK_BYTES];
        let mut file_bytes = 0;
        loop {
            let n_bytes = content.read(&mut chunk).map_err(|cause| damaged(&cause).at(name))?;
            if n_bytes == 0 {
                return Ok(());
            }
            file_bytes += n_bytes as u64;
            self.written_bytes += n_bytes as u64;
            self.check(name, file_bytes)?;
            file.write_all(&chunk[..n_bytes]).map_err(|cause| unwritable(&cause))?;
        }
    }

    fn check(&self, name: &str, file_bytes: u64) -> Result<(), AppError> {
        if file_bytes > FILE_LIMIT_BYTES {
            return Err(too_large(format!("the archive's file {name:?} has more than {FILE_LIMIT_BYTES} bytes")));
        }
        if self.written_bytes > self.limit_bytes {
            let limit_bytes = self.limit_bytes;
            return Err(too_large(format!("the archive unpacks to more than {limit_bytes} bytes")));
        }
        if self.written_bytes > self.room_bytes {
            return Err(AppError::new(
                ErrorKind::StorageFull,
                "there is not enough disk space to unpack the archive",
            )
            .remedy("delete captures or scans that are no longer needed"));
        }
        Ok(())
    }
}

/// The archive does not match its stated type.
pub(super) fn damaged(cause: &dyn std::error::Error) -> AppError {
    AppError::new(ErrorKind::BadRequest, "the archive is damaged or not of its stated type")
        .because(cause.to_string())
        .remedy("pack the capture again as zip or tar and send it with its content type")
}

/// An entry that is neither a file nor a folder.
pub(super) fn not_a_file(name: &str, what: &str) -> AppError {
    AppError::new(ErrorKind::Impossible, format!("the archive's entry {name:?} is {what}"))
        .remedy("pack plain files and folders only")
        .at(name)
}

pub(super) fn too_many_entries() -> AppError {
    too_large(format!("the archive has more than {ENTRY_LIMIT} entries"))
}

fn too_large(what: String) -> AppError {
    AppError::new(ErrorKind::TooLarge, what)
        .remedy("use fewer or smaller images, or split several scans into several captures")
}

fn unreadable(cause: &std::io::Error) -> AppError {
    AppError::new(ErrorKind::Internal, "the archive cannot be read back").because(cause.to_string())
}

/// Writing failed.
pub(super) fn unwritable(cause: &std::io::Error) -> AppError {
    let kind = match cause.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => ErrorKind::StorageFull,
        _ => ErrorKind::Internal,
    };
    AppError::new(kind, "a capture cannot be written to the disk")
        .because(cause.to_string())
        .remedy("check the disk under the data directory")
}
