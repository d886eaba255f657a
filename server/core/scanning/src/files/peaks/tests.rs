//! Written data is read back to the last bit; truncation, damage and wrong counts are detected without allocating
//! memory. That a cloud from peaks equals the cloud from images is tested in the service.

use std::io::Cursor;

use optics::StagePosition;
use remedy::Remedy as _;
use vision::{CentrelinePoint, Centrelines, Segment};

use super::*;

const HEADER: PeaksHeader = PeaksHeader {
    width_px: 1280,
    height_px: 1024,
    line_direction: LineDirection::Columns,
    stage: StageKind::Linear,
};

fn frame(idx: u32, n_points: u32) -> ScanFrame {
    let point = |at: u32| CentrelinePoint {
        u_px: f64::from(at) / 3.0,
        v_px: -1.0 / 7.0 + f64::from(idx),
        normal: [0.6, -0.8],
        sigma_px: 1e-3 * f64::from(at + 1),
        intensity: 180.25 + at as f32,
        width_px: 4.7,
        saturated: at % 3 == 1,
    };
    let piece = |n: u32| Segment { points: (0..n).map(point).collect() };
    let segments = vec![piece(n_points), piece(0), piece(1)];
    ScanFrame {
        centrelines: Centrelines {
            segments,
            direction: HEADER.line_direction,
            correlation_px: 3.3,
            lit_line: None,
        },
        position: StagePosition::LinearMm(f64::from(idx) * 0.1 - 20.0),
    }
}

fn dark() -> ScanFrame {
    let centrelines = Centrelines { direction: HEADER.line_direction, ..Centrelines::default() };
    ScanFrame { centrelines, position: StagePosition::LinearMm(0.1 + 0.2) }
}

fn written(frames: &[ScanFrame]) -> Vec<u8> {
    let mut writer = PeaksWriter::begin(Vec::new(), &HEADER).unwrap();
    for (idx, frame) in frames.iter().enumerate() {
        writer.add(frame, (idx != 1).then_some(idx as u64 * 1_000_003)).unwrap();
    }
    writer.finish().unwrap()
}

fn frames() -> Vec<ScanFrame> {
    vec![frame(0, 5), dark(), frame(2, 17), frame(3, 1)]
}

#[test]
fn peaks_are_read_back_to_the_last_bit() {
    let peaks = read_peaks(Cursor::new(written(&frames()))).unwrap();
    assert_eq!(peaks.header, HEADER);
    assert_eq!(peaks.frames, frames());
    assert_eq!(peaks.captured_at_ns, [Some(0), None, Some(2_000_006), Some(3_000_009)]);
    assert_eq!(read_peaks(Cursor::new(written(&[]))).unwrap().frames, []);
}

#[test]
fn the_lines_of_a_cross_keep_their_directions() {
    let header = PeaksHeader { line_direction: LineDirection::Rows, ..HEADER };
    let of = |line: i8, direction| {
        let mut frame = frame(0, 5);
        (frame.centrelines.lit_line, frame.centrelines.direction) = (Some(line), direction);
        frame
    };
    let frames = [of(0, LineDirection::Rows), of(1, LineDirection::Columns)];
    let mut writer = PeaksWriter::begin(Vec::new(), &header).unwrap();
    frames.iter().for_each(|frame| writer.add(frame, None).unwrap());
    assert_eq!(read_peaks(Cursor::new(writer.finish().unwrap())).unwrap().frames, frames);
}

#[test]
fn the_bytes_match_the_table_in_the_documentation() {
    let bytes = written(&[frame(1, 1)]);
    assert_eq!(&bytes[..32], b"sheaf-peaks/2\n\0\0\x00\x05\0\0\x00\x04\0\0\x01\0\0\0\0\0\0\0");
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let f64_at = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let body = 3 * 8 + 4 + 3 * 4 + 2 * POINT_BYTES;
    assert_eq!((u32_at(40), u32_at(44) as usize), (FRAME_RECORD, body));
    assert_eq!((f64_at(48), u32_at(72), u32_at(76)), (-19.9, 3, 1));
    assert_eq!(f64_at(80 + 8), -1.0 / 7.0 + 1.0);
    let end = 48 + body + 8;
    assert_eq!((u32_at(end), u32_at(end + 4), u32_at(end + 8)), (END_RECORD, 8, 1));
    assert_eq!(bytes.len(), end + 24);
}

#[test]
fn a_truncated_file_is_an_error_and_its_intact_frames_are_the_prefix() {
    let bytes = written(&frames());
    let ends = record_ends();
    for keep in 0..bytes.len() {
        assert!(read_peaks(Cursor::new(&bytes[..keep])).is_err(), "cut at {keep}");
        let prefix = read_peaks_prefix(Cursor::new(&bytes[..keep]));
        if keep < 40 {
            assert!(prefix.is_err(), "cut at {keep}");
            continue;
        }
        let whole = ends.iter().filter(|end| **end <= keep).count();
        let prefix = prefix.unwrap();
        assert_eq!((prefix.peaks.frames, prefix.finished), (frames()[..whole].to_vec(), false), "cut at {keep}");
    }
    assert!(read_peaks_prefix(Cursor::new(&bytes)).unwrap().finished);
}

/// End of each frame's record, bytes.
fn record_ends() -> Vec<usize> {
    (1..=frames().len()).map(|n| written(&frames()[..n]).len() - 24).collect()
}

#[test]
fn every_flipped_byte_is_detected() {
    let bytes = written(&frames());
    for at in 0..bytes.len() {
        // Bytes 28 to 31 are reserved; the checksum guards them too.
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x41;
        assert!(read_peaks(Cursor::new(&damaged)).is_err(), "byte {at}");
        if let Ok(prefix) = read_peaks_prefix(Cursor::new(&damaged)) {
            let n = prefix.peaks.frames.len();
            assert_eq!(prefix.peaks.frames, frames()[..n], "byte {at}");
        }
    }
}

#[test]
fn wrong_counts_with_valid_checksums_are_refused_without_allocating() {
    let mut body = Vec::new();
    body.extend(0f64.to_le_bytes());
    body.extend(0u64.to_le_bytes());
    body.extend(1f64.to_le_bytes());
    body.extend(u32::MAX.to_le_bytes());
    body.extend(u32::MAX.to_le_bytes());
    let head = [FRAME_RECORD.to_le_bytes(), (body.len() as u32).to_le_bytes()].concat();
    let mut bytes = written(&[])[..40].to_vec();
    bytes.extend(&head);
    bytes.extend(&body);
    bytes.extend(Checksum::of(&[&head, &body]).to_le_bytes());
    let problem = read_peaks(Cursor::new(bytes)).unwrap_err();
    assert_eq!(problem.to_string(), "frame 0: the checksum does not match");
    assert!(problem.remedy().is_some());
    let mut long = written(&[])[..40].to_vec();
    long.extend([FRAME_RECORD.to_le_bytes(), u32::MAX.to_le_bytes()].concat());
    assert!(read_peaks(Cursor::new(long)).is_err());
    let mut more = written(&frames());
    more.push(0);
    assert!(read_peaks(Cursor::new(more)).unwrap_err().to_string().contains("bytes follow the end"));
}

#[test]
fn a_scan_resumed_after_an_interrupted_write_ends_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("peaks");
    let whole = written(&frames());
    let torn = record_ends()[1] + 13;
    std::fs::write(&path, &whole[..torn]).unwrap();
    let (mut writer, prefix) = PeaksWriter::resume(&path).unwrap();
    assert_eq!(prefix.peaks.frames, frames()[..2]);
    assert_eq!(writer.n_frames(), 2);
    for (idx, frame) in frames().iter().enumerate().skip(2) {
        writer.add(frame, Some(idx as u64 * 1_000_003)).unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), whole);
}
