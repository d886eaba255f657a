//! The intact records of an MCAP file from its beginning, for finished and interrupted files.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use mcap::records::{ChunkHeader, Record, op};

use crate::error::RecordingError;
use crate::params::MAX_RECORD_BYTES;

/// A record with its position.
pub struct Located {
    /// Its offset in the file.
    pub offset_bytes: u64,
    /// Its opcode.
    pub op: u8,
    /// Its content.
    pub body: Bytes,
}

/// The next item of a file.
pub enum Next {
    /// A record.
    Record(Located),
    /// The regular end: footer and magic.
    End,
    /// The file ends early; no intact record follows.
    Truncated {
        /// Bytes that do not belong to an intact record.
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
    /// Opens a file and checks its beginning.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let failed = |action| move |cause| RecordingError::File { action, path: path.to_owned(), cause };
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

    /// Size of the file.
    pub fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// The next record.
    pub fn next(&mut self) -> Result<Next, RecordingError> {
        let rest_bytes = self.size_bytes - self.offset_bytes;
        if self.footer {
            let mut magic = [0; 8];
            let ends = self.file.read_exact(&mut magic).is_ok() && magic == *mcap::MAGIC;
            return Ok(if ends { Next::End } else { Next::Truncated { rest_bytes } });
        }
        if rest_bytes < OP_AND_LENGTH_BYTES {
            return Ok(Next::Truncated { rest_bytes });
        }
        let mut head = [0; OP_AND_LENGTH_BYTES as usize];
        self.file.read_exact(&mut head).map_err(|cause| self.unreadable(cause))?;
        let (op, length) = (head[0], u64::from_le_bytes(head[1..].try_into().expect("eight of nine bytes")));
        if length > (rest_bytes - OP_AND_LENGTH_BYTES).min(MAX_RECORD_BYTES) || op == 0 {
            return Ok(Next::Truncated { rest_bytes });
        }
        let mut body = vec![0; length as usize];
        self.file.read_exact(&mut body).map_err(|cause| self.unreadable(cause))?;
        let record = Located { offset_bytes: self.offset_bytes, op, body: body.into() };
        self.offset_bytes += OP_AND_LENGTH_BYTES + length;
        self.footer = op == op::FOOTER;
        Ok(Next::Record(record))
    }

    /// The record at that offset.
    pub fn at(&mut self, offset_bytes: u64) -> Result<Next, RecordingError> {
        self.file.seek(SeekFrom::Start(offset_bytes)).map_err(|cause| self.unreadable(cause))?;
        (self.offset_bytes, self.footer) = (offset_bytes, false);
        self.next()
    }

    fn unreadable(&self, cause: std::io::Error) -> RecordingError {
        RecordingError::File { action: "read", path: self.path.clone(), cause }
    }
}

/// Refuses opcodes that the format does not define, as they indicate damage.
///
/// # Errors
/// A description.
pub fn check_opcode(op: u8) -> Result<(), String> {
    const FIRST_PRIVATE: u8 = 0x80;
    match op {
        op::HEADER..=op::DATA_END | FIRST_PRIVATE.. => Ok(()),
        _ => Err(format!("unknown opcode {op:#04x}")),
    }
}

/// Compares the number of messages read with that in the index.
///
/// # Errors
/// A description.
pub fn check_count(statistics: &mcap::records::Statistics, n_read: u64) -> Result<(), String> {
    if statistics.message_count == n_read {
        return Ok(());
    }
    Err(format!("the index counts {} messages, {n_read} were read", statistics.message_count))
}

/// The decompressed and checked records of a chunk.
///
/// # Errors
/// A description of the damage.
pub fn decompressed_chunk(chunk: &Bytes) -> Result<Bytes, String> {
    let record = mcap::read::parse_record(op::CHUNK, chunk).map_err(|error| error.to_string())?;
    let Record::Chunk { header, data } = record else { return Err("a chunk without a header".to_owned()) };
    let bytes = decompressed(&header, &data)?;
    if header.uncompressed_crc != 0 && crc32fast::hash(&bytes) != header.uncompressed_crc {
        return Err("its checksum does not match".to_owned());
    }
    Ok(bytes)
}

fn decompressed(header: &ChunkHeader, data: &[u8]) -> Result<Bytes, String> {
    if header.uncompressed_size > MAX_RECORD_BYTES {
        return Err(format!(
            "it decompresses to {} bytes, more than {MAX_RECORD_BYTES}",
            header.uncompressed_size
        ));
    }
    let bytes = match header.compression.as_str() {
        "" => data.to_vec(),
        "zstd" => {
            zstd::bulk::decompress(data, header.uncompressed_size as usize).map_err(|error| error.to_string())?
        }
        other => return Err(format!("its compression {other} is not supported")),
    };
    if bytes.len() as u64 != header.uncompressed_size {
        return Err(format!("it decompresses to {} bytes instead of {}", bytes.len(), header.uncompressed_size));
    }
    Ok(bytes.into())
}

/// The records within a decompressed chunk: opcode, and range of the body.
pub fn records_in(chunk: &Bytes) -> impl Iterator<Item = (u8, std::ops::Range<usize>)> + '_ {
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
