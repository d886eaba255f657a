//! Zip archives, entry by entry, in constant memory.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use zip::ZipReadOptions;
use zip::read::Config;
use zip::result::ZipError;
use zip::unstable::read::ZipIterable;

use crate::error::{AppError, ErrorKind};
use crate::resources::captures::limits::ENTRY_LIMIT;
use crate::resources::captures::unpack::{Sink, damaged, not_a_file, too_many_entries};

/// The file-type bits of a Unix mode, and the two accepted types.
const TYPE_BITS: u32 = 0o170_000;
const TYPE_FILE: u32 = 0o100_000;
const TYPE_FOLDER: u32 = 0o040_000;

pub(super) fn unpack(archive: &Path, sink: &mut Sink) -> Result<(), AppError> {
    let mut directory = ZipIterable::try_new(reader(archive)?, Config::default()).map_err(refusal)?;
    if directory.len() > ENTRY_LIMIT {
        return Err(too_many_entries());
    }
    // Directory and local headers must agree: other programs must not see other files.
    let options = ZipReadOptions::new().enforce_header_consistency(true);
    let mut entries = directory.files_with_reader(reader(archive)?, options).map_err(refusal)?;
    while let Some(entry) = entries.next() {
        let mut entry = entry.map_err(refusal)?;
        sink.count()?;
        let name = entry.name().map_err(refusal)?.into_owned();
        match entry.unix_mode().map_or(0, |mode| mode & TYPE_BITS) {
            0 | TYPE_FILE | TYPE_FOLDER => {}
            _ => return Err(not_a_file(&name, "a link or a device")),
        }
        if entry.is_dir() {
            sink.folder(&name)?;
        } else {
            sink.file(&name, &mut entry)?;
        }
    }
    Ok(())
}

fn reader(archive: &Path) -> Result<BufReader<File>, AppError> {
    File::open(archive).map(BufReader::new).map_err(|cause| damaged(&cause))
}

fn refusal(error: ZipError) -> AppError {
    match error {
        ZipError::UnsupportedArchive(_)
        | ZipError::CompressionMethodNotSupported(_)
        | ZipError::InvalidPassword => {
            AppError::new(ErrorKind::Impossible, "the zip file uses an unsupported feature")
                .because(error.to_string())
                .remedy("pack it without encryption, with method store or deflate")
        }
        other => damaged(&other),
    }
}
