//! Reading a recording: one pass indexes its content, then images are read in any order.

use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bytes::Bytes;
use mcap::records::{Record, op};
use prost::Message as _;
use vision::GreyImage;

use crate::error::RecordingError;
use crate::foxglove::RawImage;
use crate::frames;
use crate::header::{END, HEADER, RecordingEnd, RecordingHeader};
use crate::messages::{EventNote, FrameNote, RowNote, SettingsNote};
use crate::params::CALIBRATION_NAME;
use crate::records::{Located, Next, Records, check_count, check_opcode, decompressed_chunk, records_in};
use crate::topics::Topic;

/// A recording with readable frames.
pub struct RecordingFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Size of the file.
    pub size_bytes: u64,
    /// Its header.
    pub header: RecordingHeader,
    /// The calibration document in the recording.
    pub calibration: Option<Bytes>,
    /// Its frames, in order of capture.
    pub frames: Vec<RecordedFrame>,
    /// The frames that are rows of a scan.
    pub rows: Vec<RowNote>,
    /// Device settings, with the log time in ns.
    pub settings: Vec<(u64, SettingsNote)>,
    /// Events, with the log time in ns.
    pub events: Vec<(u64, EventNote)>,
    /// Messages by topic.
    pub n_messages: BTreeMap<String, u64>,
    /// How it ended; `None` if it was interrupted.
    pub end: Option<RecordingEnd>,
    /// Whether index and end are present, as MCAP programs expect.
    pub is_complete: bool,
    /// Unreadable parts.
    pub damaged_parts: Vec<Damage>,
    chunks: Mutex<ChunkReader>,
}

/// A frame of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedFrame {
    /// Metadata of the image.
    pub note: FrameNote,
    /// The middle of its exposure, Unix time in nanoseconds.
    pub at_ns: u64,
    /// Columns, rows and bits per pixel.
    pub shape: (usize, usize, u32),
    chunk_at_bytes: u64,
    message: std::ops::Range<usize>,
}

/// An unreadable part of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Offset of its first byte.
    pub at_bytes: u64,
    /// Its length.
    pub size_bytes: u64,
    /// What is wrong.
    pub reason: String,
}

/// Reader of chunks, with the last one cached: frames are usually read in order.
struct ChunkReader {
    records: Records,
    chunk: Option<(u64, Bytes)>,
}

/// Length of the head of a message: channel, sequence, log and publish time.
const MESSAGE_HEAD_BYTES: usize = 22;

impl RecordingFile {
    /// Indexes the content of a recording; if it was interrupted, its intact part.
    ///
    /// # Errors
    /// [`RecordingError::NotMcap`], [`RecordingError::NotARecording`], or a file that cannot be read.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut records = Records::open(path)?;
        let size_bytes = records.size_bytes();
        let mut index = Index::default();
        let is_complete = loop {
            match records.next()? {
                Next::Record(record) => index.take(record),
                Next::End => break true,
                Next::Truncated { rest_bytes } => {
                    if rest_bytes > 0 {
                        let reason = "the file ends within a record".to_owned();
                        index.damaged_parts.push(Damage {
                            at_bytes: size_bytes - rest_bytes,
                            size_bytes: rest_bytes,
                            reason,
                        });
                    }
                    break false;
                }
            }
        };
        let not_a_recording = |reason| RecordingError::NotARecording { path: path.to_owned(), reason };
        let header = match index.header {
            Some(header) => header.map_err(not_a_recording)?,
            None => return Err(not_a_recording("its header is missing".to_owned())),
        };
        Ok(Self {
            path: path.to_owned(),
            size_bytes,
            header,
            calibration: index.calibration,
            frames: index.frames,
            rows: index.rows,
            settings: index.settings,
            events: index.events,
            n_messages: index.n_messages,
            end: index.end,
            is_complete,
            damaged_parts: index.damaged_parts,
            chunks: Mutex::new(ChunkReader { records, chunk: None }),
        })
    }

    /// Writes the pixels of frame `idx` into `target`, reusing its memory: exactly as delivered by the camera.
    ///
    /// # Errors
    /// [`RecordingError::Frame`] if the file has changed in the meantime, or cannot be read.
    pub fn read_into(&self, idx: usize, target: &mut GreyImage) -> Result<(), RecordingError> {
        let frame = &self.frames[idx];
        let failed = |reason| RecordingError::Frame { sequence: frame.note.sequence, reason };
        let mut chunks = self.chunks.lock();
        let chunk = chunks.chunk_at(frame.chunk_at_bytes)?.map_err(failed)?;
        drop(chunks);
        let changed = || failed("the file changed while it was read".to_owned());
        if frame.message.end > chunk.len() {
            return Err(changed());
        }
        let image = RawImage::decode(chunk.slice(frame.message.clone())).map_err(|_| changed())?;
        frames::decode(&image, target).map_err(failed)
    }

    /// The pixels of frame `idx`.
    ///
    /// # Errors
    /// As [`RecordingFile::read_into`].
    pub fn image(&self, idx: usize) -> Result<GreyImage, RecordingError> {
        let mut image = GreyImage::new(1, 1, vision::Pixels::Eight(vec![0])).expect("one pixel is an image");
        self.read_into(idx, &mut image)?;
        Ok(image)
    }
}

impl ChunkReader {
    fn chunk_at(&mut self, offset_bytes: u64) -> Result<Result<Bytes, String>, RecordingError> {
        if let Some((at, chunk)) = &self.chunk
            && *at == offset_bytes
        {
            return Ok(Ok(chunk.clone()));
        }
        let Next::Record(Located { op: op::CHUNK, body, .. }) = self.records.at(offset_bytes)? else {
            return Ok(Err("its chunk is missing".to_owned()));
        };
        let chunk = decompressed_chunk(&body);
        self.chunk = chunk.clone().ok().map(|chunk| (offset_bytes, chunk));
        Ok(chunk)
    }
}

/// The content of the file.
#[derive(Default)]
struct Index {
    header: Option<Result<RecordingHeader, String>>,
    calibration: Option<Bytes>,
    topics: BTreeMap<u16, Option<Topic>>,
    names: BTreeMap<u16, String>,
    n_messages: BTreeMap<String, u64>,
    /// Metadata of the next image.
    note: Option<(u64, FrameNote)>,
    frames: Vec<RecordedFrame>,
    rows: Vec<RowNote>,
    settings: Vec<(u64, SettingsNote)>,
    events: Vec<(u64, EventNote)>,
    end: Option<RecordingEnd>,
    damaged_parts: Vec<Damage>,
}

impl Index {
    fn take(&mut self, record: Located) {
        let result = match record.op {
            op::CHUNK => {
                decompressed_chunk(&record.body).and_then(|chunk| self.take_chunk(record.offset_bytes, &chunk))
            }
            _ => self.take_record(record.op, &record.body, None),
        };
        if let Err(reason) = result {
            let size_bytes = record.body.len() as u64;
            self.damaged_parts.push(Damage { at_bytes: record.offset_bytes, size_bytes, reason });
        }
    }

    fn take_chunk(&mut self, chunk_at_bytes: u64, chunk: &Bytes) -> Result<(), String> {
        for (op, body) in records_in(chunk) {
            let location = (chunk_at_bytes, body.start + MESSAGE_HEAD_BYTES..body.end);
            self.take_record(op, &chunk.slice(body), Some(location))?;
        }
        Ok(())
    }

    fn take_record(
        &mut self,
        op: u8,
        body: &Bytes,
        location: Option<(u64, std::ops::Range<usize>)>,
    ) -> Result<(), String> {
        check_opcode(op)?;
        if ![op::METADATA, op::ATTACHMENT, op::CHANNEL, op::MESSAGE, op::STATISTICS].contains(&op) {
            return Ok(());
        }
        match mcap::read::parse_record(op, body).map_err(|error| error.to_string())? {
            Record::Metadata(found) if found.name == HEADER => {
                self.header.get_or_insert_with(|| RecordingHeader::from_metadata(&found.metadata));
            }
            Record::Metadata(found) if found.name == END => {
                self.end = RecordingEnd::from_metadata(&found.metadata)
            }
            Record::Attachment { header, data, .. } if header.name == CALIBRATION_NAME => {
                self.calibration.get_or_insert_with(|| Bytes::copy_from_slice(&data));
            }
            Record::Statistics(statistics) => check_count(&statistics, self.n_messages.values().sum())?,
            Record::Channel(channel) => {
                let topic = Topic::ALL.into_iter().find(|topic| topic.name() == channel.topic);
                self.topics.insert(channel.id, topic);
                self.names.insert(channel.id, channel.topic);
            }
            Record::Message { header, .. } => {
                let message = body.slice(MESSAGE_HEAD_BYTES.min(body.len())..);
                self.take_message(header.channel_id, header.log_time, &message, location)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn take_message(
        &mut self,
        channel: u16,
        at_ns: u64,
        message: &Bytes,
        location: Option<(u64, std::ops::Range<usize>)>,
    ) -> Result<(), String> {
        fn json<T: for<'de> serde::Deserialize<'de>>(message: &Bytes) -> Result<T, String> {
            serde_json::from_slice(message).map_err(|error| error.to_string())
        }
        let name = self.names.get(&channel).ok_or("a message of an unknown channel")?;
        *self.n_messages.entry(name.clone()).or_default() += 1;
        match self.topics.get(&channel).copied().flatten() {
            Some(Topic::Frame) => self.note = Some((at_ns, json(message)?)),
            Some(Topic::Row) => self.rows.push(json(message)?),
            Some(Topic::Settings) => self.settings.push((at_ns, json(message)?)),
            Some(Topic::Event) => self.events.push((at_ns, json(message)?)),
            Some(Topic::Image) => {
                let found = self.note.take().filter(|(noted_at_ns, _)| *noted_at_ns == at_ns);
                let (_, note) = found.ok_or("an image without its metadata")?;
                let (chunk_at_bytes, message_at) = location.ok_or("an image outside of a chunk")?;
                let image = RawImage::decode(message.clone()).map_err(|error| error.to_string())?;
                let shape = frames::shape(&image)?;
                self.frames.push(RecordedFrame { note, at_ns, shape, chunk_at_bytes, message: message_at });
            }
            _ => {}
        }
        Ok(())
    }
}
