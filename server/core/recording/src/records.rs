//! The records of an MCAP file from its beginning, as long as they are whole: what a process that died has left as well
//! as a finished file.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use mcap::records::{ChunkHeader, Record, op};

use crate::error::RecordingError;
use crate::params::MOST_RECORD_BYTES;

/// A record and where it lies.
pub struct Located {
    /// Where it begins.
    pub offset_bytes: u64,
    /// Which kind.
    pub op: u8,
    /// What it says.
    pub body: Bytes,
}

/// What comes next.
pub enum Next {
    /// A record.
    Record(Located),
    /// The end as it must be: footer and magic.
    End,
    /// The file ends before its end; after so many bytes nothing whole follows.
    BrokenOff {
        /// Bytes that belong to no whole record.
        rest_bytes: u64,
    },
}

/// Reads the records of a file one by one.
pub struct Records {
    file: BufReader<File>,
    path: PathBuf,
    offset_bytes: u64,
    size_bytes: u64,
    footer: bool,
}

const OP_AND_LENGTH_BYTES: u64 = 9;

impl Records {
    /// Opens a file and checks how it begins.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let failed = |act| move |cause| RecordingError::File { act, path: path.to_owned(), cause };
        let file = File::open(path).map_err(failed("open"))?;
        let size_bytes = file.metadata().map_err(failed("read"))?.len();
        let mut file = BufReader::with_capacity(1 << 20, file);
        let mut magic = [0; 8];
        let begins = file.read_exact(&mut magic).is_ok() && magic == *mcap::MAGIC;
        if !begins {
            return Err(RecordingError::NotMcap { path: path.to_owned() });
        }
        Ok(Self { file, path: path.to_owned(), offset_bytes: magic.len() as u64, size_bytes, footer: false })
    }

    /// Bytes of the file.
    pub fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// The next record.
    pub fn next(&mut self) -> Result<Next, RecordingError> {
        let rest_bytes = self.size_bytes - self.offset_bytes;
        if self.footer {
            let mut magic = [0; 8];
            let ends = self.file.read_exact(&mut magic).is_ok() && magic == *mcap::MAGIC;
            return Ok(if ends { Next::End } else { Next::BrokenOff { rest_bytes } });
        }
        if rest_bytes < OP_AND_LENGTH_BYTES {
            return Ok(Next::BrokenOff { rest_bytes });
        }
        let mut head = [0; OP_AND_LENGTH_BYTES as usize];
        self.file.read_exact(&mut head).map_err(|cause| self.unreadable(cause))?;
        let (op, length) = (head[0], u64::from_le_bytes(head[1..].try_into().expect("eight of nine bytes")));
        if length > (rest_bytes - OP_AND_LENGTH_BYTES).min(MOST_RECORD_BYTES) || op == 0 {
            return Ok(Next::BrokenOff { rest_bytes });
        }
        let mut body = vec![0; length as usize];
        self.file.read_exact(&mut body).map_err(|cause| self.unreadable(cause))?;
        let record = Located { offset_bytes: self.offset_bytes, op, body: body.into() };
        self.offset_bytes += OP_AND_LENGTH_BYTES + length;
        self.footer = op == op::FOOTER;
        Ok(Next::Record(record))
    }

    /// The record that begins there.
    pub fn at(&mut self, offset_bytes: u64) -> Result<Next, RecordingError> {
        self.file.seek(SeekFrom::Start(offset_bytes)).map_err(|cause| self.unreadable(cause))?;
        (self.offset_bytes, self.footer) = (offset_bytes, false);
        self.next()
    }

    fn unreadable(&self, cause: std::io::Error) -> RecordingError {
        RecordingError::File { act: "read", path: self.path.clone(), cause }
    }
}

/// Refuses a kind of record that the format does not have: then a bit has flipped in it.
///
/// # Errors
/// In words.
pub fn check_kind(op: u8) -> Result<(), String> {
    const FIRST_PRIVATE: u8 = 0x80;
    match op {
        op::HEADER..=op::DATA_END | FIRST_PRIVATE.. => Ok(()),
        _ => Err(format!("there is no record of kind {op:#04x}")),
    }
}

/// Compares the messages that were read with those that the index counts.
///
/// # Errors
/// In words.
pub fn check_count(statistics: &mcap::records::Statistics, n_read: u64) -> Result<(), String> {
    if statistics.message_count == n_read {
        return Ok(());
    }
    Err(format!("the index counts {} messages, {n_read} were read", statistics.message_count))
}

/// The records of a chunk, unpacked and checked.
///
/// # Errors
/// What is wrong with it, in words.
pub fn unpacked(chunk: &Bytes) -> Result<Bytes, String> {
    let record = mcap::read::parse_record(op::CHUNK, chunk).map_err(|error| error.to_string())?;
    let Record::Chunk { header, data } = record else { return Err("a chunk without a chunk's head".to_owned()) };
    let bytes = decompressed(&header, &data)?;
    if header.uncompressed_crc != 0 && crc32fast::hash(&bytes) != header.uncompressed_crc {
        return Err("its checksum is not the one that was written".to_owned());
    }
    Ok(bytes)
}

fn decompressed(header: &ChunkHeader, data: &[u8]) -> Result<Bytes, String> {
    if header.uncompressed_size > MOST_RECORD_BYTES {
        return Err(format!("it unpacks to {} bytes, more than {MOST_RECORD_BYTES}", header.uncompressed_size));
    }
    let bytes = match header.compression.as_str() {
        "" => data.to_vec(),
        "zstd" => {
            zstd::bulk::decompress(data, header.uncompressed_size as usize).map_err(|error| error.to_string())?
        }
        other => return Err(format!("it is compressed by {other}, which this program does not read")),
    };
    if bytes.len() as u64 != header.uncompressed_size {
        return Err(format!(
            "it unpacks to {} bytes where {} were written",
            bytes.len(),
            header.uncompressed_size
        ));
    }
    Ok(bytes.into())
}

/// The records within an unpacked chunk: op, and where their bodies lie.
pub fn within(chunk: &Bytes) -> impl Iterator<Item = (u8, std::ops::Range<usize>)> + '_ {
    let mut at = 0;
    std::iter::from_fn(move || {
        let head = chunk.get(at..at + OP_AND_LENGTH_BYTES as usize)?;
        let length = u64::from_le_bytes(head[1..].try_into().ok()?);
        let begin = at + head.len();
        let end = begin.checked_add(usize::try_from(length).ok()?).filter(|end| *end <= chunk.len())?;
        at = end;
        Some((head[0], begin..end))
    })
}
