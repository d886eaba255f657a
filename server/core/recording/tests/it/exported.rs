//! Export of a recording as a capture folder.

use capture::Capture;
use recording::{FrameLosses, RecordingFile, export};

use crate::common::*;

#[test]
fn a_recorded_scan_becomes_a_capture_of_its_rows_with_its_calibration() {
    for bits in [8, 16] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        write(&path, bits, |_| FrameLosses::default(), true);
        let out = folder.path().join("capture");
        let mut progress = Vec::new();
        let exported =
            export(&RecordingFile::open(&path).unwrap(), &out, |row, n_rows| progress.push((row, n_rows)))
                .unwrap();
        let n_rows = N_FRAMES - FIRST_ROW;
        assert_eq!(
            (exported.n_frames, exported.n_without_position, exported.n_rows_missing),
            (n_rows as u64, 0, 0)
        );
        assert_eq!(progress, (0..n_rows).map(|row| (row, n_rows)).collect::<Vec<_>>());
        assert_eq!(std::fs::read(exported.calibration.unwrap()).unwrap(), CALIBRATION);
        let capture = Capture::open(&out).unwrap();
        assert_eq!(capture.warnings, Vec::<String>::new());
        assert_eq!(
            (&capture.manifest.target, &capture.manifest.projector),
            (&header().target, &header().projector)
        );
        let scan = capture.scan("12").unwrap();
        for (row, frame) in scan.frames.iter().enumerate() {
            assert_eq!(frame.position_mm, Some(position_mm(row + FIRST_ROW)), "to the last bit");
            let image = capture.image("frame", &frame.image).unwrap();
            assert_eq!(image, test_image(row + FIRST_ROW, bits));
        }
    }
}
