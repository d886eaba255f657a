//! Tar archives, header by header; names from GNU and PAX extensions are read within limits.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use tar::{Archive, Entry, EntryType};

use crate::error::AppError;
use crate::resources::captures::limits::TAR_HEADER_LIMIT_BYTES;
use crate::resources::captures::unpack::{Sink, damaged, not_a_file};

pub(super) fn unpack(archive: &Path, sink: &mut Sink) -> Result<(), AppError> {
    let file = File::open(archive).map_err(|cause| damaged(&cause))?;
    let mut archive = Archive::new(BufReader::new(file));
    // Raw: the library would read extended headers of any length into memory.
    let entries = archive.entries().map_err(|cause| damaged(&cause))?.raw(true);
    let mut long_name = None;
    for entry in entries {
        let mut entry = entry.map_err(|cause| damaged(&cause))?;
        match entry.header().entry_type() {
            EntryType::GNULongName => {
                long_name = Some(text(strip_zeros(extended(&mut entry)?))?);
                continue;
            }
            EntryType::XHeader => {
                long_name = pax_path(&extended(&mut entry)?)?.or(long_name);
                continue;
            }
            EntryType::XGlobalHeader => {
                extended(&mut entry)?;
                continue;
            }
            _ => {}
        }
        sink.count()?;
        let name = match long_name.take() {
            Some(name) => name,
            None => text(entry.path_bytes().into_owned())?,
        };
        match entry.header().entry_type() {
            EntryType::Regular | EntryType::Continuous => sink.file(&name, &mut entry)?,
            EntryType::Directory => sink.folder(&name)?,
            _ => return Err(not_a_file(&name, "a link, a device or a sparse file")),
        }
    }
    Ok(())
}

fn extended(entry: &mut Entry<impl Read>) -> Result<Vec<u8>, AppError> {
    if entry.size() > TAR_HEADER_LIMIT_BYTES {
        return Err(malformed("an extended header is too long"));
    }
    let mut bytes = Vec::new();
    entry.take(TAR_HEADER_LIMIT_BYTES).read_to_end(&mut bytes).map_err(|cause| damaged(&cause))?;
    Ok(bytes)
}

/// The value of `path` in records of the form `length key=value\n`; a stated size is refused, because only files
/// beyond all limits need one.
fn pax_path(mut records: &[u8]) -> Result<Option<String>, AppError> {
    let mut path = None;
    while !records.is_empty() {
        let blank =
            records.iter().position(|byte| *byte == b' ').ok_or_else(|| malformed("a record has no length"))?;
        let length: usize = std::str::from_utf8(&records[..blank])
            .ok()
            .and_then(|digits| digits.parse().ok())
            .filter(|length| (blank + 2..=records.len()).contains(length))
            .ok_or_else(|| malformed("a record has a wrong length"))?;
        let record = &records[blank + 1..length - 1];
        if let Some(value) = record.strip_prefix(b"path=") {
            path = Some(text(value.to_vec())?);
        }
        if record.starts_with(b"size=") || record.starts_with(b"GNU.sparse") {
            return Err(malformed("a record states another size than its header"));
        }
        records = &records[length..];
    }
    Ok(path)
}

fn strip_zeros(mut bytes: Vec<u8>) -> Vec<u8> {
    while bytes.last() == Some(&0) {
        bytes.pop();
    }
    bytes
}

fn text(bytes: Vec<u8>) -> Result<String, AppError> {
    String::from_utf8(bytes).map_err(|_| malformed("a name is not UTF-8"))
}

fn malformed(why: &'static str) -> AppError {
    damaged(&std::io::Error::new(std::io::ErrorKind::InvalidData, why))
}
