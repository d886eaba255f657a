//! A small recording of a scan.

use std::path::Path;

use capture::{ChessboardTarget, GratingProjector, NominalPosition};
use recording::{
    DeviceNote, EventNote, FrameLosses, FrameNote, PeakLine, PeaksNote, ProfilePoint, RecordingEnd,
    RecordingHeader, RecordingWriter, RowNote, SettingsNote, StageNote,
};
use serde_json::json;
use vision::{GreyImage, Pixels};

pub const WIDTH_PX: usize = 32;
pub const HEIGHT_PX: usize = 24;
pub const N_FRAMES: usize = 6;
pub const STARTED_AT_NS: u64 = 1_700_000_000_123_456_789;
pub const CALIBRATION: &[u8] = br#"{"id": "c0ffee"}"#;

/// Frames from this one on are rows of the scan; those before belong to the approach.
pub const FIRST_ROW: usize = 2;

pub fn header() -> RecordingHeader {
    RecordingHeader {
        name: "12".into(),
        origin: "scan".into(),
        scan_id: Some("s1".into()),
        calibration_id: Some("c0ffee".into()),
        software_version: "0.1.0".into(),
        simulated: Some("twin".into()),
        started_at_ms: (STARTED_AT_NS / 1_000_000) as i64,
        target: ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: 12.0.into() }.into(),
        projector: GratingProjector {
            wavelength_nm: 660.0,
            grating_lines_per_mm: 50.0,
            orders: vec![-1, 0, 1],
            line_direction: Some("columns".into()),
        }
        .into(),
        stage: capture::StageDescription::default(),
    }
}

/// Every pixel differs from frame to frame; 16-bit values use the high byte.
pub fn test_image(idx: usize, bits: u32) -> GreyImage {
    let value = |pixel: usize| (pixel * 7919 + idx * 104_729) as u64;
    let pixels = match bits {
        8 => Pixels::Eight((0..WIDTH_PX * HEIGHT_PX).map(|pixel| value(pixel) as u8).collect()),
        _ => Pixels::Sixteen((0..WIDTH_PX * HEIGHT_PX).map(|pixel| value(pixel) as u16).collect()),
    };
    GreyImage::new(WIDTH_PX, HEIGHT_PX, pixels).unwrap()
}

/// Not a round number in any base.
pub fn position_mm(idx: usize) -> f64 {
    -1.0 + idx as f64 * 0.1
}

pub fn note(idx: usize) -> FrameNote {
    FrameNote {
        sequence: 100 + idx as u64,
        captured_at_ns: 5_000_000 * idx as u64,
        position: NominalPosition::PositionMm(position_mm(idx) + 0.001).into(),
        exposure_us: 812.5,
        laser_on: true,
        lost_before: FrameLosses::default(),
    }
}

pub fn at_ns(idx: usize) -> u64 {
    STARTED_AT_NS + 33_333_333 * idx as u64
}

fn device(model: &str) -> DeviceNote {
    DeviceNote {
        connected: true,
        driver: "twin".into(),
        vendor: String::new(),
        model: model.into(),
        serial: "1".into(),
        firmware: String::new(),
        settings: [("exposure_us".to_owned(), json!(812.5))].into(),
    }
}

/// Writes a recording frame by frame, each in a chunk of its own; `lost` returns the exposures missing before a frame.
pub fn write(path: &Path, bits: u32, lost: impl Fn(usize) -> FrameLosses, finish: bool) {
    let file = std::fs::File::create(path).unwrap();
    let mut writer = RecordingWriter::create(file, &header(), Some(CALIBRATION)).unwrap();
    let settings = SettingsNote { camera: device("camera"), stage: device("stage"), laser: device("laser") };
    writer.note(STARTED_AT_NS, &settings).unwrap();
    let mut all_lost = FrameLosses::default();
    for idx in 0..N_FRAMES {
        let stage = StageNote {
            position: NominalPosition::PositionMm(position_mm(idx)).into(),
            moving: idx > 0,
            homed: true,
        };
        writer.note(at_ns(idx), &stage).unwrap();
        if idx >= FIRST_ROW {
            let (sequence, row) = (note(idx).sequence, (idx - FIRST_ROW) as u64);
            let position = NominalPosition::PositionMm(position_mm(idx)).into();
            writer.note(at_ns(idx), &RowNote { sequence, row, position }).unwrap();
        }
        all_lost.add(&lost(idx));
        let note = FrameNote { lost_before: lost(idx), ..note(idx) };
        writer.frame(at_ns(idx), &note, &test_image(idx, bits)).unwrap();
        let line = PeakLine {
            u_px: vec![1.0, 2.5],
            v_px: vec![3.0, 3.25],
            sigma_px: vec![0.05; 2],
            intensity: vec![90.0; 2],
        };
        writer.note(at_ns(idx), &PeaksNote { sequence: note.sequence, lines: vec![line] }).unwrap();
        let point = ProfilePoint { position_mm: [1.0, -2.0, 400.0], order: -1, sigma_mm: 0.02 };
        writer.profile(at_ns(idx), [point]).unwrap();
        writer.flush().unwrap();
    }
    let event =
        EventNote { kind: "stage.moved".into(), subject: "stage".into(), body: json!({ "target_mm": 1.0 }) };
    writer.note(at_ns(N_FRAMES), &event).unwrap();
    if finish {
        let reason = "the frames of the scan are taken".to_owned();
        let end = RecordingEnd { reason, n_frames: N_FRAMES as u64, lost: all_lost, n_notes_lost: 0 };
        writer.finish(&end).unwrap();
    } else {
        writer.flush().unwrap();
        // As after a crash: without index and end.
        std::mem::forget(writer);
    }
}

pub fn nothing_lost(_: usize) -> FrameLosses {
    FrameLosses::default()
}
