//! Completes an interrupted recording: copies everything readable, and writes an index and an end.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use bytes::Bytes;
use mcap::records::{Record, op};
use mcap::write::NoSeek;

use crate::error::RecordingError;
use crate::file::Damage;
use crate::records::{Next, Records, check_count, check_opcode, decompressed_chunk, records_in};
use crate::writer::options;

/// Result of a repair.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repaired {
    /// Messages kept.
    pub n_messages: u64,
    /// Unreadable parts, which were not copied.
    pub damaged_parts: Vec<Damage>,
    /// Whether the file was already complete.
    pub was_complete: bool,
}

impl Repaired {
    /// Whether data of the file are missing in the new one.
    pub fn is_lossy(&self) -> bool {
        !self.damaged_parts.is_empty()
    }
}

/// Copies every readable record of `from` to the new file `to`, and writes index and end. Accepts any MCAP file.
///
/// # Errors
/// [`RecordingError::NotMcap`], or files that cannot be read or written.
pub fn repair(from: &Path, to: &Path) -> Result<Repaired, RecordingError> {
    let mut records = Records::open(from)?;
    let failed = |cause| RecordingError::File { action: "write", path: to.to_owned(), cause };
    let file = File::create_new(to).map_err(failed)?;
    let mut copy = Copy {
        file: options().create(NoSeek::new(BufWriter::with_capacity(1 << 20, file)))?,
        channels: BTreeMap::new(),
        schemas: BTreeMap::new(),
        n_messages: 0,
    };
    let mut damaged_parts = Vec::new();
    let was_complete = loop {
        let record = match records.next()? {
            Next::Record(record) => record,
            Next::End => break true,
            Next::Truncated { rest_bytes } => {
                if rest_bytes > 0 {
                    let reason = "the file ends within a record".to_owned();
                    let at_bytes = records.size_bytes() - rest_bytes;
                    damaged_parts.push(Damage { at_bytes, size_bytes: rest_bytes, reason });
                }
                break false;
            }
        };
        let result = match record.op {
            op::CHUNK => match decompressed_chunk(&record.body) {
                Ok(chunk) => records_in(&chunk).try_for_each(|(op, body)| copy.take(op, &chunk.slice(body))),
                Err(reason) => Err(NotCopied::Unreadable(reason)),
            },
            // Everything after the data is generated again.
            op => copy.take(op, &record.body),
        };
        match result {
            Ok(()) => {}
            Err(NotCopied::Unreadable(reason)) => {
                let size_bytes = record.body.len() as u64;
                damaged_parts.push(Damage { at_bytes: record.offset_bytes, size_bytes, reason });
            }
            Err(NotCopied::Unwritable(error)) => return Err(error.into()),
        }
    };
    copy.file.finish()?;
    let out = copy.file.into_inner().into_inner();
    let file = out.into_inner().map_err(|error| failed(error.into_error()))?;
    file.sync_all().map_err(failed)?;
    Ok(Repaired { n_messages: copy.n_messages, damaged_parts, was_complete })
}

enum NotCopied {
    Unreadable(String),
    Unwritable(mcap::McapError),
}

impl From<mcap::McapError> for NotCopied {
    fn from(error: mcap::McapError) -> Self {
        Self::Unwritable(error)
    }
}

struct Copy<W: std::io::Write> {
    file: mcap::Writer<NoSeek<W>>,
    /// Ids in the new file by ids in the old one.
    channels: BTreeMap<u16, u16>,
    schemas: BTreeMap<u16, u16>,
    n_messages: u64,
}

impl<W: std::io::Write> Copy<W> {
    fn take(&mut self, op: u8, body: &Bytes) -> Result<(), NotCopied> {
        const COPIED: [u8; 6] =
            [op::METADATA, op::ATTACHMENT, op::SCHEMA, op::CHANNEL, op::MESSAGE, op::STATISTICS];
        check_opcode(op).map_err(NotCopied::Unreadable)?;
        if !COPIED.contains(&op) {
            return Ok(());
        }
        let record =
            mcap::read::parse_record(op, body).map_err(|error| NotCopied::Unreadable(error.to_string()))?;
        let unknown = |what: &str| NotCopied::Unreadable(format!("it refers to {what} that was not read"));
        match record {
            Record::Metadata(metadata) => self.file.write_metadata(&metadata)?,
            Record::Attachment { header, data, .. } => self.file.attach(&mcap::Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            })?,
            Record::Statistics(statistics) => {
                check_count(&statistics, self.n_messages).map_err(NotCopied::Unreadable)?;
            }
            // The summary repeats them.
            Record::Schema { header, .. } if self.schemas.contains_key(&header.id) => {}
            Record::Channel(channel) if self.channels.contains_key(&channel.id) => {}
            Record::Schema { header, data } => {
                let id = self.file.add_schema(&header.name, &header.encoding, &data)?;
                self.schemas.insert(header.id, id);
            }
            Record::Channel(channel) => {
                let schema = match channel.schema_id {
                    0 => 0,
                    id => *self.schemas.get(&id).ok_or_else(|| unknown("a schema"))?,
                };
                let encoding = &channel.message_encoding;
                let id = self.file.add_channel(schema, &channel.topic, encoding, &channel.metadata)?;
                self.channels.insert(channel.id, id);
            }
            Record::Message { mut header, data } => {
                header.channel_id = *self.channels.get(&header.channel_id).ok_or_else(|| unknown("a channel"))?;
                self.file.write_to_known_channel(&header, &data)?;
                self.n_messages += 1;
            }
            _ => {}
        }
        Ok(())
    }
}
