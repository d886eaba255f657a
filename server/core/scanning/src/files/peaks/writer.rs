//! Writing peaks, one frame at a time.

use std::fs::{File, OpenOptions};
use std::io::{BufReader, Seek, SeekFrom, Write};
use std::path::Path;

use vision::{CentrelinePoint, Centrelines, LineDirection};

use super::{
    ALONG_COLUMNS, Checksum, END_RECORD, FRAME_RECORD, MAGIC, NO_TIME, POINT_BYTES, PeaksHeader, PeaksPrefix,
    RECORD_LIMIT_BYTES, read_peaks_prefix, word_of, word_of_stage,
};
use crate::error::ContentError;
use crate::files::FileError;
use crate::input::frames::ScanFrame;

/// Writes frames one by one; [`PeaksWriter::finish`] completes the file.
#[derive(Debug)]
pub struct PeaksWriter<W: Write> {
    out: W,
    n_frames: u64,
    /// The record being written; its memory is reused.
    record: Vec<u8>,
}

impl<W: Write> PeaksWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// [`ContentError::Io`] if writing fails.
    pub fn begin(mut out: W, header: &PeaksHeader) -> Result<Self, ContentError> {
        let mut bytes = MAGIC.to_vec();
        for word in
            [header.width_px, header.height_px, word_of(header.line_direction), word_of_stage(header.stage)]
        {
            bytes.extend(word.to_le_bytes());
        }
        let sum = Checksum::of(&[&bytes]);
        bytes.extend(sum.to_le_bytes());
        out.write_all(&bytes)?;
        Ok(Self { out, n_frames: 0, record: Vec::new() })
    }

    /// Frames written so far.
    pub fn n_frames(&self) -> u64 {
        self.n_frames
    }

    /// Adds a frame, whose position is of the header's kind; `captured_at_ns` is by the station's clock, if known.
    ///
    /// # Errors
    /// [`ContentError::Io`] if writing fails, [`ContentError::Malformed`] for more points than a record holds.
    pub fn add(&mut self, frame: &ScanFrame, captured_at_ns: Option<u64>) -> Result<(), ContentError> {
        self.add_lines(&frame.centrelines, frame.position.value(), captured_at_ns)
    }

    /// The same for borrowed centrelines. `position`: in mm, or in degrees for a turntable.
    ///
    /// # Errors
    /// As [`PeaksWriter::add`].
    pub fn add_lines(
        &mut self,
        centrelines: &Centrelines,
        position: f64,
        captured_at_ns: Option<u64>,
    ) -> Result<(), ContentError> {
        let mut record = std::mem::take(&mut self.record);
        let packed = pack_frame(&mut record, centrelines, position, captured_at_ns);
        let added = packed.and_then(|()| self.add_packed(&record));
        self.record = record;
        added
    }

    /// Adds a record packed by [`pack_frame`], in one write.
    ///
    /// # Errors
    /// [`ContentError::Io`] if writing fails.
    pub fn add_packed(&mut self, record: &[u8]) -> Result<(), ContentError> {
        self.out.write_all(record)?;
        self.n_frames += 1;
        Ok(())
    }

    /// Flushes the buffer to the operating system, so that the data survives the end of this process.
    ///
    /// # Errors
    /// [`ContentError::Io`].
    pub fn flush(&mut self) -> Result<(), ContentError> {
        Ok(self.out.flush()?)
    }

    /// Writes the end record and returns the output.
    ///
    /// # Errors
    /// [`ContentError::Io`].
    pub fn finish(mut self) -> Result<W, ContentError> {
        let n_frames = self.n_frames;
        pack_record(&mut self.record, END_RECORD, |body| body.extend(n_frames.to_le_bytes()))?;
        self.out.write_all(&self.record)?;
        self.out.flush()?;
        Ok(self.out)
    }
}

/// Unbuffered: each record is one write.
impl PeaksWriter<File> {
    /// Creates a new file.
    ///
    /// # Errors
    /// [`FileError::Write`].
    pub fn create(path: &Path, header: &PeaksHeader) -> Result<Self, FileError> {
        let begun = File::create_new(path).map_err(ContentError::from).and_then(|file| Self::begin(file, header));
        begun.map_err(|error| FileError::writing(path, error))
    }

    /// Resumes an unfinished file: its intact part is kept and returned, the rest is cut off.
    ///
    /// # Errors
    /// [`FileError`]: unreadable, damaged header, or not writable.
    pub fn resume(path: &Path) -> Result<(Self, PeaksPrefix), FileError> {
        let read = |cause| FileError::Read { path: path.to_owned(), cause };
        let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(read)?;
        let prefix =
            read_peaks_prefix(BufReader::new(&mut file)).map_err(|error| FileError::reading(path, error))?;
        let cut = file.set_len(prefix.intact_bytes).and_then(|()| file.seek(SeekFrom::Start(prefix.intact_bytes)));
        cut.map_err(|cause| FileError::Write { path: path.to_owned(), cause })?;
        let n_frames = prefix.peaks.frames.len() as u64;
        Ok((Self { out: file, n_frames, record: Vec::new() }, prefix))
    }
}

/// Packs a frame for [`PeaksWriter::add_packed`], replacing the content of `record`; needs no disk. `position`: in mm,
/// or in degrees for a turntable.
///
/// # Errors
/// [`ContentError::Malformed`] for more points than a record holds.
pub fn pack_frame(
    record: &mut Vec<u8>,
    centrelines: &Centrelines,
    position: f64,
    captured_at_ns: Option<u64>,
) -> Result<(), ContentError> {
    pack_record(record, FRAME_RECORD, |body| write_frame(body, centrelines, position, captured_at_ns))
}

/// Kind, size, body, checksum.
fn pack_record(
    record: &mut Vec<u8>,
    kind: u32,
    write_body: impl FnOnce(&mut Vec<u8>),
) -> Result<(), ContentError> {
    const HEAD_BYTES: usize = 8;
    record.clear();
    record.extend(kind.to_le_bytes());
    record.extend([0; 4]);
    write_body(record);
    let n_bytes = record.len() - HEAD_BYTES;
    let size = u32::try_from(n_bytes).ok().filter(|size| *size <= RECORD_LIMIT_BYTES).ok_or_else(|| {
        ContentError::malformed(
            "a frame of the scan",
            format!("{n_bytes} bytes of points are more than {RECORD_LIMIT_BYTES}"),
            "check exposure and laser: this is not an image of laser lines",
        )
    })?;
    record[4..HEAD_BYTES].copy_from_slice(&size.to_le_bytes());
    let sum = Checksum::of(&[record]);
    record.extend(sum.to_le_bytes());
    Ok(())
}

fn write_frame(body: &mut Vec<u8>, centrelines: &Centrelines, position: f64, captured_at_ns: Option<u64>) {
    let Centrelines { segments, correlation_px, lit_line, direction } = centrelines;
    body.extend(position.to_le_bytes());
    body.extend(captured_at_ns.unwrap_or(NO_TIME).to_le_bytes());
    body.extend(correlation_px.to_le_bytes());
    // Counts beyond 24 bits would exceed the record limit, which is checked before anything is written; lines switched
    // on one by one are numbered from 0.
    let line = lit_line.and_then(|line| u32::try_from(line).ok()).map_or(0, |line| line + 1);
    let along_columns = if line > 0 && *direction == LineDirection::Columns { ALONG_COLUMNS } else { 0 };
    body.extend((segments.len() as u32 | line << 24 | along_columns).to_le_bytes());
    for segment in segments {
        body.extend((segment.points.len() as u32).to_le_bytes());
        body.reserve(segment.points.len() * POINT_BYTES);
        for point in &segment.points {
            body.extend_from_slice(&point_bytes(point));
        }
    }
}

fn point_bytes(point: &CentrelinePoint) -> [u8; POINT_BYTES] {
    let mut bytes = [0; POINT_BYTES];
    let doubles = [point.u_px, point.v_px, point.normal[0], point.normal[1], point.sigma_px];
    for (slot, value) in bytes.chunks_exact_mut(8).zip(doubles) {
        slot.copy_from_slice(&value.to_le_bytes());
    }
    bytes[40..44].copy_from_slice(&point.intensity.to_le_bytes());
    bytes[44..48].copy_from_slice(&point.width_px.to_le_bytes());
    bytes[48] = u8::from(point.saturated);
    bytes
}
