//! The peaks of a scan, `sheaf-peaks/2`: every frame's centrelines with position and time, exact to the last bit.
//!
//! From them a scan is computed again with another calibration, and an interrupted one goes on. Little endian.
//! A header of 40 bytes, then records, one per frame, then an end record; without it the file is unfinished.
//! Every record carries a checksum, so that a file cut or damaged anywhere shows how far it can be trusted.
//! The byte table: `server/docs/service/scans.md`.

mod file;
mod reader;
mod writer;

pub use file::{PeaksFile, read_one_frame, read_positions};
pub use reader::{PeaksPrefix, read_peaks, read_peaks_prefix};
pub use writer::{PeaksWriter, pack_frame};

use optics::StageKind;
use vision::LineDirection;

use crate::input::frames::ScanFrame;

/// First bytes of every such file.
const MAGIC: &[u8; 16] = b"sheaf-peaks/2\n\0\0";

/// Record of one frame.
const FRAME_RECORD: u32 = 1;

/// Last record: the number of frames.
const END_RECORD: u32 = 2;

/// Time stamp of a frame whose time is unknown.
const NO_TIME: u64 = u64::MAX;

/// Bytes of a point: u, v, normal, σ as f64; intensity and width as f32; one byte of flags.
const POINT_BYTES: usize = 5 * 8 + 2 * 4 + 1;

/// Set beside the number of a line that was lit alone: it runs along columns, whatever the header says of the others.
const ALONG_COLUMNS: u32 = 1 << 31;

/// Longest record, bytes: a frame of 1.3 million points, far beyond what lines on a 50 megapixel sensor give.
const RECORD_LIMIT_BYTES: u32 = 64 << 20;

/// What holds for all frames of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PeaksHeader {
    /// Image columns.
    pub width_px: u32,
    /// Image rows.
    pub height_px: u32,
    /// Which way lines were looked for.
    pub line_direction: LineDirection,
    /// What moved the part: the unit of the positions.
    pub stage: StageKind,
}

/// The frames of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Peaks {
    /// What holds for all of them.
    pub header: PeaksHeader,
    /// In order of capture, as [`crate::scan_cloud`] takes them.
    pub frames: Vec<ScanFrame>,
    /// Per frame: nanoseconds by the station's monotonic clock; `None` where a recording does not state it.
    pub captured_at_ns: Vec<Option<u64>>,
}

/// CRC-32 in 64 bits: finds what disks and cut copies do to a file, at the speed of memory; who changes it on purpose
/// is none of its business.
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
