//! Reading peaks. Counts are not trusted: memory grows with the bytes actually read.

use std::io::Read;

use optics::StageKind;
use vision::{CentrelinePoint, Centrelines, LineDirection, Segment};

use super::{
    ALONG_COLUMNS, Checksum, END_RECORD, FRAME_RECORD, MAGIC, NO_TIME, POINT_BYTES, Peaks, PeaksHeader,
    RECORD_LIMIT_BYTES,
};
use crate::error::ContentError;
use crate::input::frames::ScanFrame;

/// Remedy for damaged bytes.
const RESTORE: &str = "restore the file from a backup, or scan again";

/// The intact beginning of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct PeaksPrefix {
    /// Its frames.
    pub peaks: Peaks,
    /// Its length, without an end record.
    pub intact_bytes: u64,
    /// Whether the end record follows: nothing is missing.
    pub finished: bool,
}

/// Reads a finished file.
///
/// # Errors
/// [`ContentError::Malformed`] if a byte is missing, wrong or surplus; a truncated scan is never returned.
pub fn read_peaks(mut input: impl Read) -> Result<Peaks, ContentError> {
    let mut peaks = Peaks { header: read_header(&mut input)?, frames: Vec::new(), captured_at_ns: Vec::new() };
    loop {
        let place = format!("frame {}", peaks.frames.len());
        match read_record(&mut input, &place)? {
            Record::Frame(body) => add_frame(&mut peaks, &body, &place)?,
            Record::End(n_frames) => {
                check_end(&mut input, n_frames, peaks.frames.len())?;
                return Ok(peaks);
            }
        }
    }
}

/// Checks that all frames were read and nothing follows.
pub(super) fn check_end(input: &mut impl Read, n_stated: u64, n_frames: usize) -> Result<(), ContentError> {
    if n_stated != n_frames as u64 {
        let problem = format!("the file ends after {n_frames} of {n_stated} frames");
        return Err(ContentError::malformed("end", problem, RESTORE));
    }
    match input.read(&mut [0])? {
        0 => Ok(()),
        _ => Err(ContentError::malformed("end", "bytes follow the end", RESTORE)),
    }
}

/// Reads the intact part of a file: to its end, or to the first record that is truncated or damaged.
///
/// # Errors
/// [`ContentError`] if the header is damaged or reading fails.
pub fn read_peaks_prefix(mut input: impl Read) -> Result<PeaksPrefix, ContentError> {
    let header = read_header(&mut input)?;
    let mut peaks = Peaks { header, frames: Vec::new(), captured_at_ns: Vec::new() };
    let mut intact_bytes = HEADER_BYTES as u64;
    loop {
        let record = match read_record(&mut input, "frame") {
            Ok(record) => record,
            Err(ContentError::Malformed { .. }) => {
                return Ok(PeaksPrefix { peaks, intact_bytes, finished: false });
            }
            Err(error) => return Err(error),
        };
        match record {
            Record::Frame(body) => {
                if add_frame(&mut peaks, &body, "frame").is_err() {
                    return Ok(PeaksPrefix { peaks, intact_bytes, finished: false });
                }
                intact_bytes += (RECORD_FRAME_BYTES + body.len()) as u64;
            }
            Record::End(n_frames) => {
                let finished = n_frames == peaks.frames.len() as u64;
                return Ok(PeaksPrefix { peaks, intact_bytes, finished });
            }
        }
    }
}

pub(super) const HEADER_BYTES: usize = 40;

/// Bytes of a record around its body: kind, size, checksum.
pub(super) const RECORD_FRAME_BYTES: usize = 4 + 4 + 8;

pub(super) enum Record {
    Frame(Vec<u8>),
    End(u64),
}

pub(super) fn read_header(input: &mut impl Read) -> Result<PeaksHeader, ContentError> {
    let mut bytes = [0; HEADER_BYTES];
    input.read_exact(&mut bytes).map_err(|cause| ContentError::truncated(cause, || "header".into()))?;
    if &bytes[..16] != MAGIC {
        let remedy = "use a peaks file that this version of the program supports";
        return Err(ContentError::malformed("header", "the file does not begin with `sheaf-peaks/2`", remedy));
    }
    let mut cursor = Cursor { bytes: &bytes[16..], place: "header" };
    let (width_px, height_px, direction) = (cursor.u32()?, cursor.u32()?, cursor.u32()?);
    let (stage, sum) = (cursor.u32()?, cursor.u64()?);
    if sum != Checksum::of(&[&bytes[..32]]) {
        return Err(damaged("header"));
    }
    let line_direction = match direction {
        0 => LineDirection::Rows,
        1 => LineDirection::Columns,
        _ => return Err(damaged("header")),
    };
    let stage = match stage {
        0 => StageKind::Linear,
        1 => StageKind::Rotary,
        _ => return Err(damaged("header")),
    };
    Ok(PeaksHeader { width_px, height_px, line_direction, stage })
}

/// The beginning of a record: its kind and size.
pub(super) struct RecordHead {
    bytes: [u8; Self::BYTES],
    pub kind: u32,
    pub size_bytes: u32,
}

impl RecordHead {
    pub const BYTES: usize = 8;
}

pub(super) fn read_head(input: &mut impl Read, place: &str) -> Result<RecordHead, ContentError> {
    let mut bytes = [0; RecordHead::BYTES];
    input.read_exact(&mut bytes).map_err(|cause| ContentError::truncated(cause, || place.to_owned()))?;
    let mut cursor = Cursor { bytes: &bytes, place };
    let (kind, size_bytes) = (cursor.u32()?, cursor.u32()?);
    if size_bytes > RECORD_LIMIT_BYTES || !matches!(kind, FRAME_RECORD | END_RECORD) {
        return Err(damaged(place));
    }
    Ok(RecordHead { bytes, kind, size_bytes })
}

pub(super) fn read_record(input: &mut impl Read, place: &str) -> Result<Record, ContentError> {
    let head = read_head(input, place)?;
    let mut body = Vec::new();
    input.by_ref().take(head.size_bytes.into()).read_to_end(&mut body)?;
    let mut sum = [0; 8];
    input.read_exact(&mut sum).map_err(|cause| ContentError::truncated(cause, || place.to_owned()))?;
    if u64::from_le_bytes(sum) != Checksum::of(&[&head.bytes, &body]) {
        return Err(damaged(place));
    }
    if head.kind == FRAME_RECORD {
        return Ok(Record::Frame(body));
    }
    let mut cursor = Cursor { bytes: &body, place };
    let n_frames = cursor.u64()?;
    cursor.end()?;
    Ok(Record::End(n_frames))
}

fn add_frame(peaks: &mut Peaks, body: &[u8], place: &str) -> Result<(), ContentError> {
    let (frame, captured_at_ns) = read_frame(body, &peaks.header, place)?;
    peaks.frames.push(frame);
    peaks.captured_at_ns.push(captured_at_ns);
    Ok(())
}

/// The frame in a record, and its capture time.
pub(super) fn read_frame(
    body: &[u8],
    header: &PeaksHeader,
    place: &str,
) -> Result<(ScanFrame, Option<u64>), ContentError> {
    let mut cursor = Cursor { bytes: body, place };
    let (position, time_ns, correlation_px) = (cursor.f64()?, cursor.u64()?, cursor.f64()?);
    let packed = cursor.u32()?;
    let (n_segments, lit_line) = counted_segments(packed & !ALONG_COLUMNS);
    let direction = if packed & ALONG_COLUMNS != 0 { LineDirection::Columns } else { header.line_direction };
    let mut segments = Vec::new();
    for _ in 0..n_segments {
        let n_points = cursor.u32()? as usize;
        let bytes = cursor.take(n_points.saturating_mul(POINT_BYTES))?;
        let (points, _) = bytes.as_chunks();
        if points.iter().any(|bytes| bytes[SATURATED_BYTE] > 1) {
            return Err(damaged(place));
        }
        segments.push(Segment { points: points.iter().map(point).collect() });
    }
    cursor.end()?;
    let centrelines = Centrelines { segments, direction, correlation_px, lit_line };
    let frame = ScanFrame { centrelines, position: header.stage.position(position) };
    Ok((frame, (time_ns != NO_TIME).then_some(time_ns)))
}

/// The byte of a point with its flag: whether it is saturated.
const SATURATED_BYTE: usize = POINT_BYTES - 1;

/// A point. A scan's points are read many times, so fields are taken from fixed places, without a check of each.
fn point(bytes: &[u8; POINT_BYTES]) -> CentrelinePoint {
    let (doubles, _) = bytes.as_chunks();
    let (singles, _) = bytes[5 * size_of::<f64>()..].as_chunks();
    let double = |idx: usize| f64::from_le_bytes(doubles[idx]);
    let single = |idx: usize| f32::from_le_bytes(singles[idx]);
    CentrelinePoint {
        u_px: double(0),
        v_px: double(1),
        normal: [double(2), double(3)],
        sigma_px: double(4),
        intensity: single(0),
        width_px: single(1),
        saturated: bytes[SATURATED_BYTE] == 1,
    }
}

/// Number of segments; the bits above the lowest 24 hold one more than the number of the line that was switched on
/// alone.
fn counted_segments(packed: u32) -> (u32, Option<i8>) {
    let line = (packed >> 24).checked_sub(1).and_then(|line| i8::try_from(line).ok());
    (packed & 0xff_ffff, line)
}

pub(super) fn damaged(place: &str) -> ContentError {
    ContentError::malformed(place, "the checksum does not match", RESTORE)
}

/// The unread part of a record.
struct Cursor<'a> {
    bytes: &'a [u8],
    place: &'a str,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, n_bytes: usize) -> Result<&'a [u8], ContentError> {
        let (taken, rest) = self.bytes.split_at_checked(n_bytes).ok_or_else(|| damaged(self.place))?;
        self.bytes = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ContentError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    fn u32(&mut self) -> Result<u32, ContentError> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn u64(&mut self) -> Result<u64, ContentError> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    fn f64(&mut self) -> Result<f64, ContentError> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    fn end(&self) -> Result<(), ContentError> {
        if self.bytes.is_empty() { Ok(()) } else { Err(damaged(self.place)) }
    }
}
