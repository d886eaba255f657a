//! The peaks of a scan, `sheaf-peaks/2`: every frame's centrelines with position and time, exact to the last bit.
//!
//! They allow a scan to be recomputed with another calibration, and an interrupted one to be resumed. Little endian. A
//! header of 40 bytes, then one record per frame, then an end record; without it the file is unfinished. Every record
//! carries a checksum, so that the intact part of a truncated or damaged file is known. The byte table:
//! `server/docs/service/scans.md`.

mod file;
mod reader;
mod writer;

pub use file::{PeaksFile, read_one_frame, read_positions};
pub use reader::{PeaksPrefix, read_peaks, read_peaks_prefix};
pub use writer::{PeaksWriter, pack_frame};

use optics::StageKind;
use vision::LineDirection;

use crate::input::frames::ScanFrame;

/// First bytes of every peaks file.
const MAGIC: &[u8; 16] = b"sheaf-peaks/2\n\0\0";

/// Record of one frame.
const FRAME_RECORD: u32 = 1;

/// Last record: the number of frames.
const END_RECORD: u32 = 2;

/// Time stamp of a frame whose time is unknown.
const NO_TIME: u64 = u64::MAX;

/// Bytes of a point: u, v, normal, σ as f64; intensity and width as f32; one byte of flags.
const POINT_BYTES: usize = 5 * 8 + 2 * 4 + 1;

/// Flag beside the number of a line that was lit alone: it runs along columns, whatever the header states for the
/// others.
const ALONG_COLUMNS: u32 = 1 << 31;

/// Longest record, bytes: a frame of 1.3 million points, far beyond what lines on a 50 megapixel sensor give.
const RECORD_LIMIT_BYTES: u32 = 64 << 20;

/// Common properties of all frames of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PeaksHeader {
    /// Image columns.
    pub width_px: u32,
    /// Image rows.
    pub height_px: u32,
    /// Direction of the lines.
    pub line_direction: LineDirection,
    /// Kind of stage, which determines the unit of the positions.
    pub stage: StageKind,
}

/// The frames of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Peaks {
    /// Common properties of all frames.
    pub header: PeaksHeader,
    /// In order of capture, as [`crate::scan_cloud`] takes them.
    pub frames: Vec<ScanFrame>,
    /// Per frame: nanoseconds of the station's monotonic clock; `None` where a recording does not state it.
    pub captured_at_ns: Vec<Option<u64>>,
}

/// CRC-32 in 64 bits: detects disk errors and truncation at memory speed; not a protection against deliberate changes.
struct Checksum;

impl Checksum {
    fn of(parts: &[&[u8]]) -> u64 {
        let mut sum = crc32fast::Hasher::new();
        parts.iter().for_each(|part| sum.update(part));
        u64::from(sum.finalize())
    }
}

fn word_of(direction: LineDirection) -> u32 {
    match direction {
        LineDirection::Rows => 0,
        LineDirection::Columns => 1,
    }
}

fn word_of_stage(stage: StageKind) -> u32 {
    match stage {
        StageKind::Linear => 0,
        StageKind::Rotary => 1,
    }
}

#[cfg(test)]
mod tests;
