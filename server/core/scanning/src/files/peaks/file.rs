//! A peaks file as the frames of a scan: only the location of each frame in the file is kept in memory.

use parking_lot::Mutex;
use std::borrow::Cow;
use std::fmt::Debug;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use optics::StagePosition;
use vision::Centrelines;

use super::reader::{
    HEADER_BYTES, RECORD_FRAME_BYTES, Record, RecordHead, damaged, read_frame, read_head, read_header, read_record,
};
use super::{FRAME_RECORD, PeaksHeader};
use crate::error::ContentError;
use crate::files::FileError;
use crate::input::frames::{Frames, ScanFrame};

/// Bytes read at once when the whole file is checked.
const BUFFER_BYTES: usize = 1 << 18;

/// A finished peaks file, checked completely when it is opened. Frames are read on demand.
#[derive(Debug)]
pub struct PeaksFile {
    /// Common properties of all frames.
    pub header: PeaksHeader,
    file: Mutex<Box<dyn ReadSeek>>,
    locations: Vec<FrameLocation>,
}

/// Seekable input, used by one thread at a time.
trait ReadSeek: Read + Seek + Send + Debug {}

impl<T: Read + Seek + Send + Debug> ReadSeek for T {}

/// Location of a frame in the file, its stage position, lit line and capture time.
#[derive(Debug, Clone, Copy)]
struct FrameLocation {
    offset_bytes: u64,
    size_bytes: u32,
    position: StagePosition,
    lit_line: Option<i8>,
    captured_at_ns: Option<u64>,
}

impl PeaksFile {
    /// Opens and checks the file `path`.
    ///
    /// # Errors
    /// [`FileError::Read`], or [`FileError::Malformed`] if a byte is missing, wrong or surplus.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let file = File::open(path).map_err(|cause| FileError::Read { path: path.to_owned(), cause })?;
        Self::new(file).map_err(|error| FileError::reading(path, error))
    }

    /// Checks an open file from its beginning.
    ///
    /// # Errors
    /// [`ContentError::Malformed`] if a byte is missing, wrong or surplus; a truncated scan is never returned.
    pub fn new(mut file: impl Read + Seek + Send + Debug + 'static) -> Result<Self, ContentError> {
        let mut input = BufReader::with_capacity(BUFFER_BYTES, &mut file);
        let header = read_header(&mut input)?;
        let mut locations: Vec<FrameLocation> = Vec::new();
        let mut offset_bytes = HEADER_BYTES as u64;
        loop {
            let name = format!("frame {}", locations.len());
            match read_record(&mut input, &name)? {
                Record::Frame(body) => {
                    let (frame, captured_at_ns) = read_frame(&body, &header, &name)?;
                    locations.push(FrameLocation {
                        offset_bytes: offset_bytes + RecordHead::BYTES as u64,
                        size_bytes: body.len() as u32,
                        position: frame.position,
                        lit_line: frame.centrelines.lit_line,
                        captured_at_ns,
                    });
                    offset_bytes += (RECORD_FRAME_BYTES + body.len()) as u64;
                }
                Record::End(n_frames) => {
                    super::reader::check_end(&mut input, n_frames, locations.len())?;
                    break;
                }
            }
        }
        Ok(Self { header, file: Mutex::new(Box::new(file)), locations })
    }

    /// Capture time of a frame by the station's clock; `None` if a recording does not state it.
    pub fn captured_at_ns(&self, frame: usize) -> Option<u64> {
        self.locations[frame].captured_at_ns
    }

    /// Reads a frame.
    ///
    /// # Errors
    /// [`ContentError`] if reading fails, or the file has changed since it was checked.
    pub fn frame(&self, frame: usize) -> Result<ScanFrame, ContentError> {
        let location = &self.locations[frame];
        let mut body = vec![0; location.size_bytes as usize];
        {
            let mut file = self.file.lock();
            file.seek(SeekFrom::Start(location.offset_bytes))?;
            file.read_exact(&mut body)?;
        }
        Ok(read_frame(&body, &self.header, &format!("frame {frame}"))?.0)
    }
}

impl Frames for PeaksFile {
    fn n_frames(&self) -> usize {
        self.locations.len()
    }

    fn position(&self, frame: usize) -> StagePosition {
        self.locations[frame].position
    }

    fn lit_line(&self, frame: usize) -> Option<i8> {
        self.locations[frame].lit_line
    }

    fn centrelines(&self, frame: usize) -> Result<Cow<'_, Centrelines>, ContentError> {
        Ok(Cow::Owned(self.frame(frame)?.centrelines))
    }
}

/// The stage positions of a file's frames, from the record headers alone; the rest is neither read nor checked.
///
/// # Errors
/// [`ContentError`] for a damaged header or sequence of records.
pub fn read_positions(mut input: impl Read + Seek) -> Result<Vec<StagePosition>, ContentError> {
    let stage = read_header(&mut input)?.stage;
    let mut positions = Vec::new();
    loop {
        let name = format!("frame {}", positions.len());
        let head = read_head(&mut input, &name)?;
        if head.kind != FRAME_RECORD {
            return Ok(positions);
        }
        let mut position = [0; 8];
        input.read_exact(&mut position).map_err(|cause| ContentError::truncated(cause, || name.clone()))?;
        positions.push(stage.position(f64::from_le_bytes(position)));
        let rest =
            i64::from(head.size_bytes) + (RECORD_FRAME_BYTES - RecordHead::BYTES) as i64 - position.len() as i64;
        input.seek(SeekFrom::Current(rest))?;
    }
}

/// Reads and checks one frame with its time; those before it are skipped. The inner `Err(n)` means that the file has
/// only `n` frames.
///
/// # Errors
/// [`ContentError`] for a damaged frame or sequence of records.
pub fn read_one_frame(
    mut input: impl Read + Seek,
    frame: usize,
) -> Result<Result<(ScanFrame, Option<u64>), usize>, ContentError> {
    let header = read_header(&mut input)?;
    for idx in 0..frame {
        let head = read_head(&mut input, &format!("frame {idx}"))?;
        if head.kind != FRAME_RECORD {
            return Ok(Err(idx));
        }
        input.seek(SeekFrom::Current(
            i64::from(head.size_bytes) + (RECORD_FRAME_BYTES - RecordHead::BYTES) as i64,
        ))?;
    }
    let name = format!("frame {frame}");
    match read_record(&mut input, &name)? {
        Record::Frame(body) => Ok(Ok(read_frame(&body, &header, &name)?)),
        Record::End(n_frames) if n_frames == frame as u64 => Ok(Err(frame)),
        Record::End(_) => Err(damaged(&name)),
    }
}
